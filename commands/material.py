"""``material RESULT --to FORMAT … --out DIR``: a fit's materials for other programs."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Generator, Sequence
from functools import partial
from pathlib import Path

from ..core.concurrency.background import in_background
from ..core.concurrency.job import Step
from ..core.errors import InputError
from ..core.export import Loss, renderer_formats, table_formats, write_losses
from ..core.export.file_names import check_distinct
from ..core.export.subject import Subject
from ..core.result import FittedMaterial, FittedResult, read_result
from .needs_blender import check_blender
from .progress import Progress
from .staging import check_out, staged_folder

HELP = "export the materials of a result for other programs"
PLAIN: dict[str, Callable[[Path, Sequence[Subject]], list[Loss]]] = {
    "binary": table_formats.write_binary,
    "exr": table_formats.write_exr,
    "npz": table_formats.write_npz,
    "mtlx": renderer_formats.write_mtlx,
    "mitsuba": renderer_formats.write_mitsuba,
    "pbrt": renderer_formats.write_pbrt,
}
BLENDER = ("blend", "gltf", "usd")  # written by scene/export_formats: needs bpy
FORMATS = (*BLENDER, *PLAIN)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "result", type=Path, help="what `fit` left: its folder, or the result.json in it"
    )
    parser.add_argument(
        "--to", nargs="+", required=True, choices=FORMATS, metavar="FORMAT",
        help=f"one or more of {', '.join(FORMATS)}",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, help="folder for the files")
    parser.add_argument(
        "--material", nargs="+", metavar="NAME", help="these alone (default: all of the result)"
    )


def run(arguments: argparse.Namespace) -> None:
    out = check_out(arguments.out)
    steps = export(out, read_result(arguments.result), arguments.to, arguments.material)
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


def export(
    out: Path, result: FittedResult, formats: Sequence[str], names: Sequence[str] | None = None
) -> Generator[Step, None, tuple[list[Loss], list[str]]]:
    """Write a result's materials (``names``: these alone) into a folder, in steps. Returns what
    each format keeps of each material, and the lines of losses.txt. Raises InputError.

    BLENDER's formats open a .blend of their own, in place of the one that is open.
    """
    chosen = _chosen(result, names)
    check_distinct([material.name for material in chosen])
    for name in BLENDER:
        if name in formats:
            check_blender(f"the format {name}", f"material RESULT --to {name}")
    _check_not_itself(out, result, formats)
    formats = list(dict.fromkeys(formats))
    subjects = [Subject(material) for material in chosen]
    losses: list[Loss] = []
    with staged_folder(out) as folder:
        for done, name in enumerate(formats):
            step = Step(f"writing {name}", done / len(formats))
            yield step
            if name in PLAIN:
                losses += yield from in_background(partial(PLAIN[name], folder, subjects), step)
            else:
                losses += write_by_blender(name, folder, out, result, subjects)
        lines = write_losses(folder, losses, ", ".join(s.name for s in subjects))
    return losses, lines


def write_by_blender(
    name: str, folder: Path, out: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """Write one of BLENDER's formats into ``folder``, whose files will move to ``out``."""
    from ..scene.export import export_formats  # needs bpy

    write = {
        "blend": export_formats.to_blend,
        "gltf": export_formats.to_gltf,
        "usd": export_formats.to_usd,
    }[name]
    return write(folder, out, result, subjects)


def _chosen(result: FittedResult, names: Sequence[str] | None) -> list[FittedMaterial]:
    """The materials to export, in the result's order."""
    if names is None:
        return list(result.materials)
    known = [material.name for material in result.materials]
    for name in names:
        if name not in known:
            raise InputError(
                f"no material is called {name!r}; there are {', '.join(known)}",
                file=result.file,
                key="--material",
            )
    return [material for material in result.materials if material.name in names]


def _check_not_itself(out: Path, result: FittedResult, formats: Sequence[str]) -> None:
    """The result's own files are the only record of the fit: nothing is written over them."""
    if out.resolve() == result.file.parent.resolve():
        raise InputError(
            f"is the result's own folder; expected another one ({'/'.join(formats)} would be mixed "
            "with the record of the fit)",
            file=out,
            key="--out",
        )
