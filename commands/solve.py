"""``solve PHOTOS --out DIR``: structure from motion from a folder of photos."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.errors import InputError
from ..core.solve import SolveToFolderJob
from ..core.solve.solve import LENSES
from .progress import Progress, print_note

HELP = "compute cameras and sparse points from a folder of photos (structure from motion)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("photos", type=Path, help="folder of the photos of the scan")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--lens",
        default=LENSES[0],
        choices=LENSES,
        help="COLMAP's camera model (default %(default)s; OPENCV for strong lens distortion)",
    )
    parser.add_argument(
        "--threads", type=int, help="maximum number of threads (default: one per core)"
    )


def run(arguments: argparse.Namespace) -> None:
    check_threads(arguments.threads)
    job = SolveToFolderJob(arguments.photos, arguments.out, arguments.lens, arguments.threads)
    try:
        job.drain(Progress())
    finally:
        job.close()
    for note in job.notes:
        print_note(note)
    print(job.report, end="")
    print(f"wrote {job.out}: sparse, report.txt, {job.capture.name}")


def check_threads(threads: int | None) -> None:
    """Raise InputError unless ``threads`` is None or 1 to 1024."""
    if threads is not None and not 1 <= threads <= 1024:
        raise InputError(f"found {threads}, expected 1 to 1024", key="--threads")
