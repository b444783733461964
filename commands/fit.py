"""``fit CAPTURE --out DIR``: fit the materials of a capture and write the results."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..core.brdf import merl_file
from ..core.capture import read_capture
from ..core.concurrency.job import Step, peak_memory
from ..core.fit.measured_result import MeasuredResult
from ..core.jobs import CaptureResult, FitJob, Stage, finished
from ..core.jobs.varying.variation_estimator import MODES
from ..core.jobs.varying.varying_job import VaryingJob
from ..core.output_folder import check_out, staged_folder
from ..core.report import result_json, write_report
from ..core.report.check_layers import check_layers
from ..core.report.diagnosis_json import CheckRecord
from ..core.report.figures import reach
from ..core.report.held_out import varied_quality
from ..core.varying import storage
from ..core.viewer.page import has_program
from . import capture_arguments
from .needs_blender import has_blender
from .progress import Progress, print_note
from .solve import check_threads

FIT = "fit"  # owner of the files of a fit, and of the second fit of a diagnosis
NO_SCENE = "scene.blend was not written, because it needs Blender. All other files are complete."
HELP = "fit every material of a capture and write the results"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    capture_arguments.add_arguments(parser, "the results")
    add_varying(parser)


def add_varying(parser: argparse.ArgumentParser) -> None:
    """Add the option that ``fit`` and ``diagnose`` share."""
    parser.add_argument(
        "--varying", choices=MODES, default="never",
        help="estimate how colour, gloss and normals vary over the surface: if held-out photos "
        "prefer it (auto), never, or always (default %(default)s)",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> None:
    check_threads(arguments.threads)
    fit_to_folder(arguments.capture, arguments.out, arguments.threads, arguments.varying)


def fit_to_folder(
    capture_file: Path, out: Path, threads: int | None = None, varying: str = "never"
) -> CaptureResult:
    """Fit a capture. Write result.json, NAME.binary, report/ and, with Blender, scene.blend to
    ``out``. varying: one of MODES; where the materials vary, varying.npz too. Raises PatinaError.
    """
    out = check_out(out)
    progress = Progress(share=0.85)
    fit = FitJob(read_capture(capture_file), threads=threads)
    job = fit if varying == "never" else VaryingJob(fit, varying)
    job.drain(progress)
    result, stages = finished(job.result), job.stages
    progress.share = 1.0
    with staged_folder(out, FIT, print_note) as folder:
        write_results(folder, out, result, stages, progress)
    print_summary(out, result)
    return result


def write_results(
    folder: Path,
    out: Path,
    result: CaptureResult,
    stages: Sequence[Stage],
    progress: Progress,
    report: str = "report",
    check: CheckRecord | None = None,
) -> None:
    """Write tables, report, result.json and, with Blender, scene.blend to a staged folder, whose
    files move to ``out``. check: the diagnosis that the result is based on."""
    stages = [*stages]
    with timed(stages, "tables", progress, 0.9):
        for material in result.materials:
            merl_file.write(folder / f"{material.name}.binary", material.fit.brdf.table())
    with timed(stages, "report", progress, 0.92):
        back = "" if report == "report" else "../index.html"
        corrected = check if result.effects and has_program() else None
        layers = check_layers(corrected.found, corrected.context) if corrected else ()
        for _ in write_report(folder / report, result, back=back, layers=layers):
            pass
    notes: Sequence[str] = ()
    if has_blender():
        with timed(stages, "scene.blend", progress, 0.97):
            from ..scene.export.blend_file import write_blend  # needs bpy

            notes = write_blend(folder / "scene.blend", out / "scene.blend", result, stages, check)
    if result.varying is not None:
        with timed(stages, storage.NAME, progress, 0.99):
            storage.write(folder / storage.NAME, result.varying)
    result_json.write(folder / "result.json", result, stages, notes)


@contextmanager
def timed(stages: list[Stage], name: str, progress: Progress, fraction: float) -> Iterator[None]:
    """Report a stage of writing to ``progress``, and append its time and memory to ``stages``."""
    progress(Step(name, fraction))
    since = time.perf_counter()
    yield
    stages.append(Stage(name, time.perf_counter() - since, peak_memory()))


def print_summary(out: Path, result: CaptureResult) -> None:
    """Print a summary of a fit: errors, warnings, notes, refined lights and files."""
    varied = varied_quality(result)
    for material in result.materials:
        held = material.held_out
        rms = "" if held is None else f", relative RMS {100 * held.error:.0f} %"
        quality = material.quality.sentence + rms
        if material.name in varied:
            with_variation = varied[material.name].sentence
            quality = f"{with_variation}, one BRDF: {material.quality.sentence}"
        print(f"{material.name}: {material.samples:,} samples. {quality}")
        if isinstance(material.fit, MeasuredResult):
            print(f"  90 % interval: {reach(material.spread)}")
        for warning in material.warnings:
            print_note(warning)
    if result.proposed_photo is not None:
        print(f"proposed photo: {result.proposed_photo.sentence}")
    for note in result.notes:
        print(f"note: {note}")
    for name, parameters in result.lights.moved.items():
        values = ", ".join(f"{k} {v:.3g} ± {e:.2g}" for k, (v, e) in parameters.items())
        print(f"light {name!r} refined: {values}")
    print(f"wrote {out / 'result.json'}")
    for material in result.materials:
        print(f"      {out / (material.name + '.binary')}")
    if has_blender():
        print(f"      {out / 'scene.blend'}")
    if result.varying is not None:
        print(f"      {out / storage.NAME}")
    print(f"      {out / 'report' / 'index.html'}")
    if not has_blender():
        print(f"note: {NO_SCENE}")
