"""``masks CAPTURE --out DIR``: shadow and material masks, and a capture file that names them."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.capture import read_capture
from ..core.errors import InputError
from ..core.jobs import finished
from ..core.masks.proposal import MOST_MATERIALS
from ..core.masks.write_masks import MasksJob, MasksSettings, check_final
from ..core.output_folder import check_out, staged_folder
from .progress import Progress, print_note

HELP = "propose shadow masks and material masks of a capture, which you can repaint"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder for the masks and the capture file"
    )
    parser.add_argument(
        "--shadows",
        action="store_true",
        help="write shadow masks (the default if --materials is not given)",
    )
    parser.add_argument(
        "--materials",
        metavar="N|auto",
        help="number of materials to propose; auto: estimated from the photos",
    )
    parser.add_argument(
        "--uncertainty",
        type=float,
        metavar="U",
        help="position error of the mesh in scan units, by which shadow edges are blurred "
        "(default: a quarter of its median edge length)",
    )


def run(arguments: argparse.Namespace) -> None:
    wanted = _wanted(arguments)
    out = check_out(arguments.out)
    capture = read_capture(arguments.capture)
    check_final(capture, out)
    with staged_folder(out, "masks", print_note) as folder:
        job = MasksJob(capture, wanted, folder, out)
        job.drain(Progress())
        done = finished(job.result)
        name = done.capture.name
    if done.proposal is not None:
        names = ", ".join(done.names)
        print(f"materials: {done.proposal.count} ({names})")
        if done.proposal.count == 1:
            print("  note: The photos do not show two materials. Set a number with --materials N.")
    written = len(done.shadows) + sum(map(len, done.materials))
    print(f"wrote {written} masks and {out / name}")


def _wanted(arguments: argparse.Namespace) -> MasksSettings:
    count, requested = None, arguments.materials
    if requested not in (None, "auto"):
        if (
            not requested.isascii()
            or not requested.isdigit()
            or not 1 <= int(requested) <= MOST_MATERIALS
        ):
            raise InputError(
                f"found {requested!r}, expected auto or 1 to {MOST_MATERIALS}", key="--materials"
            )
        count = int(requested)
    blur = arguments.uncertainty
    if blur is not None and not 0 <= blur < 1e12:
        raise InputError(f"found {blur}, expected 0 or more", key="--uncertainty")
    return MasksSettings(arguments.shadows or requested is None, requested is not None, count, blur)
