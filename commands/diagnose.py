"""``diagnose CAPTURE --out DIR``: fit, say what is wrong and why, and what is gained."""

from __future__ import annotations

import argparse

from ..core.capture import read_capture
from ..core.job import FitJob, finished
from ..core.job.diagnose_job import DiagnoseJob
from ..core.report import diagnosis
from . import capture_arguments
from .progress import Progress
from .solve import check_threads
from .staging import check_out, staged_folder

HELP = "fit a capture and say what is wrong with it"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    capture_arguments.add_arguments(parser, "the diagnosis")


def run(arguments: argparse.Namespace) -> None:
    check_threads(arguments.threads)
    out = check_out(arguments.out)
    job = DiagnoseJob(FitJob(read_capture(arguments.capture), threads=arguments.threads))
    job.drain(Progress(share=0.97))
    found, setting = finished(job.found), finished(job.setting)
    with staged_folder(out) as folder:
        diagnosis.write_pages(folder / "report", arguments.capture.name, found, setting)
        diagnosis.write(folder / "diagnosis.json", found)
    for trial in found.accepted:
        print(f"{trial.effect.cause}: {trial.sentence()}")
    if found.unexplained:
        print(f"unknown: {found.left.sentence()}")
    if not found.causes:
        print("none: nothing that can be named is wrong beyond noise and the scan's own errors")
    print(
        f"not noise: {100 * found.not_noise_before:.0f} % of what the prediction misses, "
        f"{100 * found.not_noise_after:.0f} % with what is named in the model"
    )
    print(f"wrote {out / 'diagnosis.json'}")
    print(f"      {out / 'report' / 'index.html'}")
