"""``find-lights CAPTURE --out FILE``: find unknown lights from the photos that they lit."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.capture import read_capture
from ..core.capture.write_lights import write_lights
from ..core.errors import InputError
from ..core.jobs import finished
from ..core.jobs.find_lights_job import FindLightsJob
from .progress import Progress

HELP = "find unknown lights from the photos"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument(
        "--light", action="append", default=[], metavar="NAME",
        help="a light to find; may be repeated (default: all lights with guess = true)",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, required=True,
        help="the capture file to write, in the same folder; may be the capture itself",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> None:
    if arguments.out.is_dir():
        raise InputError(
            "is a folder; expected the name of a capture file", file=arguments.out, key="--out"
        )
    capture = read_capture(arguments.capture)
    job = FindLightsJob(capture, arguments.light)
    job.drain(Progress())
    found = finished(job.result)
    write_lights(capture, found.entries, arguments.out)
    for note in found.notes:
        print(f"  {note}")
    print(f"wrote {arguments.out}")
