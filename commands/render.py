"""``render RESULT --world FILE|NAME|all --out DIR``: render materials under other light."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.concurrency.job import Step
from ..core.errors import InputError
from ..core.export.subject import Subject
from ..core.output_folder import check_out, staged_folder
from ..core.report.relit import Picture, write_page
from ..core.result import read_result
from .needs_blender import check_blender
from .progress import Progress, print_note

HELP = "render the materials of a result, and the scanned object, under world images"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("result", type=Path, help="the output folder of `fit`, or its result.json")
    parser.add_argument(
        "--world", nargs="+", required=True, metavar="WORLD",
        help="a .hdr or .exr file, the name of a world that Blender ships, or 'all' of these",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, help="folder for the pictures")
    parser.add_argument(
        "--size", type=int, default=512, metavar="N", help="width and height in pixels"
    )
    parser.add_argument("--samples", type=int, default=128, metavar="N", help="samples per pixel")
    parser.add_argument(
        "--turns", type=int, default=12, metavar="N",
        help="number of pictures in one turn of the object (0: only spheres)",
    )  # fmt: skip
    parser.add_argument("--no-denoise", action="store_true", help="do not denoise the pictures")


def run(arguments: argparse.Namespace) -> None:
    for key, lowest, highest in (("size", 16, 8192), ("samples", 1, 65536), ("turns", 0, 360)):
        if not lowest <= getattr(arguments, key) <= highest:
            raise InputError(
                f"found {getattr(arguments, key)}, expected {lowest} to {highest}", key=f"--{key}"
            )
    out = check_out(arguments.out)
    pictures = render_to_folder(
        arguments.result,
        out,
        arguments.world,
        arguments.size,
        arguments.samples,
        arguments.turns,
        not arguments.no_denoise,
    )
    print(f"wrote {len(pictures)} pictures")
    print(f"      {out / 'index.html'}")


def render_to_folder(
    result_file: Path,
    out: Path,
    world_names: list[str],
    size: int,
    samples: int,
    turns: int,
    denoise: bool = True,
) -> list[Picture]:
    """Render a result under the named worlds to ``out``, with a page that shows all pictures.

    Returns the pictures. Raises PatinaError without Blender, InputError for an unknown world.
    """
    check_blender("`render`", "render")
    from ..scene.export.relight import Quality, find_worlds, relight  # needs bpy

    result = read_result(result_file)
    worlds = find_worlds(world_names)
    subjects = [Subject(material) for material in result.materials]
    progress, found = Progress(), []
    quality = Quality(size, samples, turns, denoise)
    with staged_folder(out, "render", print_note) as folder:
        for fraction, picture in relight(folder, result, subjects, worlds, quality):
            progress(Step("rendering", 0.98 * fraction))
            if picture is not None:
                found.append(picture)
        write_page(folder, found)
    return found
