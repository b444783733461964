"""``material RESULT --to FORMAT … --out DIR``: export fitted materials for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.export import Loss
from ..core.export.material_formats import BLENDER, FORMATS, export_materials
from ..core.output_folder import check_out
from ..core.result import read_result
from .needs_blender import check_blender
from .progress import Progress

HELP = "export the materials of a result for other programs"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("result", type=Path, help="the output folder of `fit`, or its result.json")
    parser.add_argument(
        "--to", nargs="+", required=True, choices=FORMATS, metavar="FORMAT",
        help=f"one or more of {', '.join(FORMATS)}",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, help="folder for the files")
    parser.add_argument(
        "--material",
        nargs="+",
        metavar="NAME",
        help="materials to export (default: all materials of the result)",
    )


def run(arguments: argparse.Namespace) -> None:
    out = check_out(arguments.out)
    for name in BLENDER:
        if name in arguments.to:
            check_blender(f"the format {name}", f"material RESULT --to {name}")
    result = read_result(arguments.result)
    steps = export_materials(out, result, arguments.to, arguments.material, _by_blender)
    progress = Progress()
    while True:
        try:
            progress(next(steps))
        except StopIteration as end:
            losses, lines = end.value
            break
    print("\n".join(lines).rstrip())
    for file in sorted({file for loss in losses for file in loss.files}):
        print(f"wrote {out / file}")
    print(f"      {out / 'losses.txt'}, losses.json")


def _by_blender(*arguments: Any) -> list[Loss]:
    from ..scene.export.export_formats import write_format  # needs bpy

    return write_format(*arguments)
