"""``diagnose CAPTURE --out DIR``: fit, say what is wrong and why, and fit again without it."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..core.capture import read_capture
from ..core.diagnose.effects import EFFECTS
from ..core.diagnose.selection.diagnosis import Diagnosis
from ..core.jobs import FitJob, finished
from ..core.jobs.check_job import CheckJob
from ..core.output_folder import check_out, staged_folder
from ..core.report import diagnosis, diagnosis_json
from . import capture_arguments
from .fit import tell, write_results
from .progress import Progress
from .solve import check_threads

MATERIALS = "report/materials"  # the second fit's own report
HELP = "fit a capture, say what is wrong with it, and fit it again with that in the model"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    capture_arguments.add_arguments(parser, "the diagnosis and the materials")
    parser.add_argument(
        "--without",
        nargs="+",
        default=[],
        metavar="CAUSE",
        choices=[kind.cause for kind in EFFECTS],
        help="leave these out of the second fit, even if they are named: %(choices)s",
    )


def run(arguments: argparse.Namespace) -> None:
    check_threads(arguments.threads)
    diagnose_to_folder(arguments.capture, arguments.out, arguments.threads, arguments.without)


def diagnose_to_folder(
    capture_file: Path, out: Path, threads: int | None = None, without: Sequence[str] = ()
) -> None:
    """Check a capture and leave diagnosis.json and report/ in ``out``, and what a fit leaves, its
    report in report/materials."""
    out = check_out(out)
    job = CheckJob(FitJob(read_capture(capture_file), threads=threads), without=without)
    progress = Progress(share=0.9)
    job.drain(progress)
    progress.share = 1.0
    checked, after = job.checked, finished(job.result)
    found, before = finished(checked.found), finished(checked.result)
    with staged_folder(out) as folder:
        report = folder / "report"
        diagnosis.write_pages(report, found, finished(checked.context), before, after)
        diagnosis_json.write(folder / "diagnosis.json", found, before, after)
        write_results(folder, out, after, job.stages, progress, MATERIALS)
    _tell_causes(found)
    tell(out, after)
    print(f"      {out / 'diagnosis.json'}")


def _tell_causes(found: Diagnosis) -> None:
    for trial in found.reported:
        print(f"{trial.effect.cause}: {found.sentence(trial)}")
    if found.unexplained:
        print(f"unknown: {found.residual.sentence()}")
    if not found.causes:
        print("none: nothing that can be named is wrong beyond noise and the scan's own errors")
    before, after = found.error_before, found.error_after
    print(
        f"left-out parts of the photos: {100 * before.parts:.1f} % off, "
        f"{100 * after.parts:.1f} % with what is named in the model"
    )
