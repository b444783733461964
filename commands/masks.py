"""``masks CAPTURE --out DIR``: shadow masks, proposed materials, a capture file with them."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.capture import read_capture
from ..core.errors import InputError
from ..core.jobs import finished
from ..core.masks.proposal import MOST_MATERIALS
from ..core.masks.write_masks import MasksJob, Wanted, check_final
from ..core.output_folder import check_out, staged_folder
from .progress import Progress

HELP = "shadow masks and proposed materials of a capture, to look at, repaint and fit with"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument("--out", type=Path, required=True, help="folder for masks and capture file")
    parser.add_argument(
        "--shadows", action="store_true", help="write shadow masks (default without --materials)"
    )
    parser.add_argument(
        "--materials",
        metavar="N|auto",
        help="propose so many materials; auto: as many as the photos show",
    )
    parser.add_argument(
        "--uncertainty",
        type=float,
        metavar="U",
        help="how far off the mesh may be, scan units: shadow edges are blurred by as much "
        "(default: a quarter of its median edge)",
    )


def run(arguments: argparse.Namespace) -> None:
    wanted = _wanted(arguments)
    out = check_out(arguments.out)
    capture = read_capture(arguments.capture)
    check_final(capture, out)
    with staged_folder(out) as folder:
        job = MasksJob(capture, wanted, folder, out)
        job.drain(Progress())
        done = finished(job.result)
        name = done.capture.name
    if done.proposal is not None:
        names = ", ".join(done.names)
        print(f"materials: {done.proposal.count} ({names})")
        if done.proposal.count == 1:
            print("  note: the photos show no two materials; say how many with --materials N")
    written = len(done.shadows) + sum(map(len, done.materials))
    print(f"wrote {written} masks and {out / name}")


def _wanted(arguments: argparse.Namespace) -> Wanted:
    count, said = None, arguments.materials
    if said not in (None, "auto"):
        if not said.isascii() or not said.isdigit() or not 1 <= int(said) <= MOST_MATERIALS:
            raise InputError(
                f"found {said!r}, expected auto or 1 to {MOST_MATERIALS}", key="--materials"
            )
        count = int(said)
    blur = arguments.uncertainty
    if blur is not None and not 0 <= blur < 1e12:
        raise InputError(f"found {blur}, expected 0 or more", key="--uncertainty")
    return Wanted(arguments.shadows or said is None, said is not None, count, blur)
