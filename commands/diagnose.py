"""``diagnose CAPTURE --out DIR``: fit, find causes of residuals, fit again with them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..core.capture import read_capture
from ..core.diagnose.effects import EFFECTS
from ..core.diagnose.effects.actions import ACTIONS
from ..core.diagnose.selection.diagnosis import Diagnosis
from ..core.jobs import CaptureResult, FitJob, finished
from ..core.jobs.check_job import CheckJob
from ..core.jobs.varying_second_fit import VaryingSecondFit
from ..core.output_folder import check_out, staged_folder
from ..core.report import diagnosis, diagnosis_json
from ..core.report.diagnosis_json import CheckRecord
from ..core.report.result_json import write_json
from . import capture_arguments
from .fit import FIT, add_varying, print_summary, write_results
from .progress import Progress, print_note
from .solve import check_threads

MATERIALS = "report/materials"  # report of the second fit
HELP = "fit a capture, find the causes of its errors, and fit again with these in the model"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    capture_arguments.add_arguments(parser, "the diagnosis and the materials")
    parser.add_argument(
        "--without",
        nargs="+",
        default=[],
        metavar="CAUSE",
        choices=list(dict.fromkeys(kind.cause for kind in EFFECTS)),  # two kinds of near lamp
        help="causes that the second fit ignores even if they are accepted: %(choices)s",
    )
    add_varying(parser)


def run(arguments: argparse.Namespace) -> None:
    check_threads(arguments.threads)
    diagnose_to_folder(
        arguments.capture, arguments.out, arguments.threads, arguments.without, arguments.varying
    )


def diagnose_to_folder(
    capture_file: Path,
    out: Path,
    threads: int | None = None,
    without: Sequence[str] = (),
    varying: str = "never",
) -> None:
    """Diagnose a capture. Write diagnosis.json, report/ and the files of a fit to ``out``; the
    report of the second fit is in report/materials. varying: one of MODES. Raises PatinaError."""
    out = check_out(out)
    check = CheckJob(FitJob(read_capture(capture_file), threads=threads), without=without)
    job = check if varying == "never" else VaryingSecondFit(check, varying)
    progress = Progress(share=0.9)
    job.drain(progress)
    progress.share = 1.0
    checked, after = job.checked, finished(job.result)
    found, before = finished(checked.found), finished(checked.result)
    with staged_folder(out, FIT, print_note) as folder:
        report = folder / "report"
        assessment = finished(checked.assessment)
        context = finished(checked.context)
        diagnosis.write_pages(report, found, assessment, context, before, after)
        description = diagnosis_json.describe(found, assessment, before, after)
        write_json(folder / "diagnosis.json", description)
        shown = CheckRecord(description, found, context)
        write_results(folder, out, after, job.stages, progress, MATERIALS, shown)
    _print_causes(found)
    _print_gain(before, after)
    print_summary(out, after)
    print(f"      {out / 'diagnosis.json'}")


def _print_causes(found: Diagnosis) -> None:
    for trial in found.reported:
        print(f"{trial.effect.cause}: {found.sentence(trial)}")
        if trial in found.named:
            print(f"  {ACTIONS[trial.effect.cause]}")
    if found.unexplained:
        print(f"unknown: {found.unexplained_sentence}")
    if not found.causes:
        print("none: No known cause found. Noise and errors of the scan explain the residuals.")
    print(found.quality.sentence())
    before, after = found.error_before, found.error_after
    print(
        f"RMS error of held-out regions of the photos: {100 * before.parts:.1f} % without and "
        f"{100 * after.parts:.1f} % with the causes found."
    )


def _print_gain(before: CaptureResult, after: CaptureResult) -> None:
    """Print the typical errors of held-out photos of the first and of the second fit, if the second
    one uses any cause."""
    if not after.effects:
        return
    pairs = [
        f"{one.name} {100 * one.held_out.typical:.1f} → {100 * other.held_out.typical:.1f} %"
        for one, other in zip(before.materials, after.materials, strict=True)
        if one.held_out is not None and other.held_out is not None
    ]
    if pairs:
        print(
            f"Typical error of a held-out photo, without → with these causes: {', '.join(pairs)}."
        )
