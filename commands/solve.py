"""``solve PHOTOS --out DIR``: structure from motion from a folder of photos."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.errors import InputError
from ..core.output_folder import check_out, staged_folder
from ..core.solve import SolveJob
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
    out = check_out(arguments.out)
    job = SolveJob(arguments.photos, arguments.lens, arguments.threads)
    try:
        job.drain(Progress())
    finally:
        job.cancel()
    with staged_folder(out, "solve", print_note) as folder:
        capture = job.solution.write(folder, out, arguments.photos)
    print(job.solution.report(), end="")
    print(f"wrote {out}: sparse, report.txt, {capture.name}")


def check_threads(threads: int | None) -> None:
    """Raise InputError unless ``threads`` is None or 1 to 1024."""
    if threads is not None and not 1 <= threads <= 1024:
        raise InputError(f"found {threads}, expected 1 to 1024", key="--threads")
