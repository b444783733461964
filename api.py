"""Patina as a Python library: capture → fit → prediction, diagnosis, files. Needs no Blender.

    import patina

    capture = patina.load_capture("my.capture.toml")
    fitted = patina.fit(capture)
    patina.export(fitted, "results", ["json", "report", "binary", "pbrt"])

Every function raises ``PatinaError`` for mistakes that a user can correct (its subclass
``InputError`` for a wrong file or value), with a message of one line: what was found, what was
expected.

Frames and units: directions are unit vectors that point away from
the surface, in the frame of the scan; the BRDF ρ is in 1/sr; angles are in radians; radiance is in
the linear unit of the photos (pixel value / exposure), irradiance in that unit × sr.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .commands.needs_blender import check_blender
from .core.angles import Angles, half_difference
from .core.basis import Basis
from .core.capture import Capture, read_capture
from .core.concurrency.job import Step
from .core.concurrency.steps import drained
from .core.diagnose.effects import EFFECTS
from .core.errors import InputError, PatinaError
from .core.export import Loss, write_losses
from .core.export.file_names import check_distinct
from .core.export.material_formats import BLENDER, PLAIN
from .core.export.subject import Subject
from .core.jobs import CaptureResult, FitJob, Job, MaterialResult, Stage, finished
from .core.jobs.check_job import CheckJob
from .core.jobs.exported_result import exported_result
from .core.jobs.photo_prediction import PhotoPrediction, predict_one, prediction_inputs
from .core.jobs.select_photos import photo_indices, select_photos
from .core.jobs.varying.variation_estimator import MODES
from .core.jobs.varying.varying_job import VaryingJob
from .core.output_folder import check_out, staged_folder
from .core.predict.errors import PhotoErrors
from .core.proposed_photo import ProposedPhoto
from .core.report import diagnosis_json, result_json, write_report
from .core.samples import SampleTable
from .core.varying import storage

__all__ = [
    "DEMO_CAPTURE",
    "FORMATS",
    "Angles",
    "Capture",
    "DiagnosisResult",
    "Finding",
    "FitResult",
    "InputError",
    "MaterialResult",
    "PatinaError",
    "PhotoErrors",
    "PhotoPrediction",
    "ProposedPhoto",
    "Step",
    "diagnose",
    "export",
    "fit",
    "half_difference",
    "load_capture",
    "predict",
    "select_photos",
]

DEMO_CAPTURE = Path(__file__).parent / "assets" / "demo" / "demo.capture.toml"
"""The capture that comes with Patina: a jar of two materials, 8 photos under 4 lamps."""

RECORD, REPORT = "json", "report"
FORMATS: tuple[str, ...] = (RECORD, REPORT, *PLAIN, *BLENDER)
"""Formats of ``export``. "json": result.json, which the command line reads; "report": report/ with
its index.html; "blend", "gltf" and "usd" need Blender; the others are those of `patina material
--to`."""

Progress = Callable[[Step], None]
"""Called before each step of the work. A step has ``stage`` (its name) and ``fraction`` (the part
of the work that is done, 0..1)."""


@dataclass(frozen=True)
class FitResult:
    """The fitted materials of a capture.

    details: all results of the fit (scan, lights, basis, material of each face). samples: name of a
    material → the reflectance samples that it was fitted to; ``diagnose`` needs them. stages: time
    and memory of each stage of the work.
    """

    details: CaptureResult
    samples: Mapping[str, SampleTable]
    stages: tuple[Stage, ...]

    @property
    def capture(self) -> Capture:
        """The capture that was fitted."""
        return self.details.capture

    @property
    def materials(self) -> tuple[MaterialResult, ...]:
        """All materials, in the order of the capture. ``material.fit.brdf`` is its BRDF, with
        ``coefficients`` (3, k) and ``evaluate(angles)`` → (n, 3) float32 ρ in 1/sr;
        ``material.held_out`` is its error on held-out photos; ``material.warnings``: sentences."""
        return self.details.materials

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what was read, assumed and ignored."""
        return self.details.notes

    @property
    def proposed_photo(self) -> ProposedPhoto | None:
        """The photo that would say most about the materials, with ``camera``, ``towards`` (unit
        direction to the lamp) and ``sentence``; None where no photo would say much."""
        return self.details.proposed_photo

    def material(self, name: str) -> MaterialResult:
        """Return the material with this name. Raises InputError if there is none."""
        for material in self.materials:
            if material.name == name:
                return material
        names = ", ".join(material.name for material in self.materials)
        raise InputError(
            f"found no material named {name!r}; expected one of {names}", key="material"
        )


@dataclass(frozen=True)
class Finding:
    """One cause that was tested. cause: its name (docs/method/diagnosis.md); sentence: its meaning;
    accepted: whether it predicts held-out regions of the photos significantly better; contradicted:
    the evidence against it, else None. gain, standard_error: increase of the log
    likelihood of held-out regions, nats; p_value: probability of such a gain by chance. parameters:
    name → (value, standard error, unit)."""

    cause: str
    sentence: str
    accepted: bool
    contradicted: str | None
    gain: float
    standard_error: float
    p_value: float
    parameters: Mapping[str, tuple[float, float, str]]


@dataclass(frozen=True)
class DiagnosisResult:
    """The causes of residuals that light, scan and materials do not explain.

    named: names of the accepted causes, with "unknown" if the residual has structure that no cause
    explains; ("none",) if there is no cause. findings: all causes that were tested, the accepted
    ones first. unexplained: whether "unknown" is among the names. before: the fit without the
    causes; after: the fit that models them. details: the content of diagnosis.json.
    """

    named: tuple[str, ...]
    findings: tuple[Finding, ...]
    unexplained: bool
    before: FitResult
    after: FitResult
    details: Mapping[str, Any]


def load_capture(path: str | os.PathLike[str]) -> Capture:
    """Read and check a capture file (docs/reference/capture-file.md).

    Raises InputError with the file, the line and the key that is wrong. The photos themselves are
    opened by ``fit``.

    >>> import patina
    >>> capture = patina.load_capture(patina.DEMO_CAPTURE)
    >>> len(capture.photos), [material.name for material in capture.materials]
    (8, ['glaze', 'clay'])
    """
    return read_capture(Path(path))


def fit(
    capture: Capture,
    *,
    basis: Basis | None = None,
    varying: str = "never",
    threads: int | None = None,
    progress: Progress | None = None,
) -> FitResult:
    """Fit the BRDF of every material of a capture.

    basis: principal components of the fit, None for the embedded basis. varying: whether colour,
    gloss and normals vary over the surface: "auto" if held-out photos prefer it, "never" or
    "always"; the variation is ``result.details.varying``. threads: number of threads that read the
    photos, None for one per core, at most four; the result does not depend on it. progress: called
    before each step. Raises InputError for wrong or missing photos, masks or lights, for another
    word in ``varying``, and if a material has no usable lit pixel.

    >>> import numpy as np
    >>> import patina
    >>> fitted = patina.fit(patina.load_capture(patina.DEMO_CAPTURE))
    >>> clay = fitted.material("clay")
    >>> clay.held_out.typical < 0.1  # error on held-out photos below 10 %
    True
    >>> angles = patina.half_difference(  # normal, light and view as (n, 3)
    ...     np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, 0.0, 1.0]])
    ... )
    >>> rho = clay.fit.brdf.evaluate(angles)  # 1/sr; terracotta reflects red most
    >>> rho.shape, bool(rho[0, 0] > rho[0, 1] > rho[0, 2] > 0)
    ((1, 3), True)
    """
    _check_threads(threads)
    if varying not in MODES:
        raise InputError(f"found {varying!r}, expected one of {', '.join(MODES)}", key="varying")
    fitting = FitJob(capture, basis=basis, threads=threads, keep=True)
    job = fitting if varying == "never" else VaryingJob(fitting, varying)
    _drain(job, progress)
    return FitResult(finished(job.result), dict(fitting.samples), tuple(job.stages))


def diagnose(
    capture: Capture | FitResult,
    *,
    without: Collection[str] = (),
    threads: int | None = None,
    progress: Progress | None = None,
) -> DiagnosisResult:
    """Find the causes of the errors of a capture, and fit it again with these in the model.

    capture: a capture, or the result of ``fit``, which is not fitted again. without: causes that
    the second fit ignores even if they are accepted. threads, progress: as for ``fit``. Takes one
    or two minutes. Raises InputError as ``fit`` does, and for an unknown cause.

    >>> import patina
    >>> fitted = patina.fit(patina.load_capture(patina.DEMO_CAPTURE))  # doctest: +SKIP
    >>> found = patina.diagnose(fitted)  # doctest: +SKIP
    >>> for finding in found.findings:  # doctest: +SKIP
    ...     print(finding.cause, finding.accepted, finding.sentence)
    """
    _check_threads(threads)
    known = [kind.cause for kind in EFFECTS]
    for cause in without:
        if cause not in known:
            raise InputError(f"found {cause!r}, expected one of {', '.join(known)}", key="without")
    if isinstance(capture, FitResult):
        fit_job: FitJob = _FinishedFit(capture, threads)
    else:
        fit_job = FitJob(capture, threads=threads)
    job = CheckJob(fit_job, without=without)
    _drain(job, progress)
    checked = job.checked
    found, before, after = finished(checked.found), finished(checked.result), finished(job.result)
    assessment = finished(checked.assessment)
    details = diagnosis_json.describe(found, assessment, before, after)
    stages = tuple(job.stages)
    return DiagnosisResult(
        named=tuple(details["named"]),
        findings=tuple(_finding(cause) for cause in details["causes"]),
        unexplained=bool(details["unexplained"]),
        before=FitResult(before, dict(fit_job.samples), stages),
        after=FitResult(after, dict(fit_job.samples), stages),
        details=details,
    )


def predict(
    capture: Capture,
    result: FitResult,
    *,
    photos: Sequence[str | int] | None = None,
    progress: Progress | None = None,
) -> tuple[PhotoPrediction, ...]:
    """Predict photos from a fit, and compare the predictions with the photos.

    capture: the fitted capture, or another one of the same mesh with other photos. photos: the
    photos to predict, by name or index from 0; None for all of them. For photos that were not part
    of the fit, nothing is estimated from the photo itself: no exposure, pose or colour, and no
    light is refined. A pixel has the material that the fit assigned to the face it shows. Light is
    direct, with cast shadows. Of the effects of a diagnosis, displaced lamps (light_direction and
    flash_offset) are part of the prediction.

    Each prediction has ``radiance``, ``encoded`` and ``measured``, (h, w, 3) float32, and
    ``errors``: typical error, relative RMS and RMSE in the encoding of the photo, over the pixels
    that show the mesh and are not next to outlines. Raises InputError if photos or lights do not
    belong to the fit, or for an unknown photo.

    >>> import patina
    >>> capture = patina.load_capture(patina.DEMO_CAPTURE)
    >>> fitted = patina.fit(patina.select_photos(capture, range(1, 8)))  # without the first
    >>> (held_out,) = patina.predict(capture, fitted, photos=["lit/view_03.exr"])
    >>> held_out.encoded.shape, held_out.errors.typical < 0.15
    ((430, 384, 3), True)
    """
    inputs = prediction_inputs(capture, result.details)
    places = range(len(capture.photos)) if photos is None else photo_indices(capture, photos)
    found = []
    for done, place in enumerate(places):
        if progress is not None:
            progress(Step(f"predicting {capture.photo_name(place)}", done / len(places)))
        found.append(drained(predict_one(inputs, place)))
    return tuple(found)


def export(
    result: FitResult,
    folder: str | os.PathLike[str],
    formats: Sequence[str] = (RECORD, REPORT, "binary"),
) -> tuple[Loss, ...]:
    """Export the materials to a folder. If this fails, no file is written.

    formats: entries of ``FORMATS``. Returns what each format keeps of each material, which is also
    written to losses.txt and losses.json. Files of the same name are replaced. Raises InputError
    for an unknown format or a folder that cannot be written to, PatinaError if a format needs
    Blender and there is none.

    >>> import tempfile
    >>> import patina
    >>> capture = patina.load_capture(patina.DEMO_CAPTURE)
    >>> fitted = patina.fit(patina.select_photos(capture, [0, 2, 4, 6]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     losses = patina.export(fitted, folder, ["json", "binary", "pbrt"])
    >>> sorted({file for loss in losses for file in loss.files if file.endswith(".binary")})
    ['clay.binary', 'glaze.binary']
    """
    requested = list(dict.fromkeys(formats))
    for name in requested:
        if name not in FORMATS:
            raise InputError(f"found {name!r}, expected one of {', '.join(FORMATS)}", key="formats")
        if name in BLENDER:
            check_blender(f"the format {name}", f"material RESULT --to {name}")
    out = check_out(Path(folder))
    check_distinct([material.name for material in result.materials])
    version = result_json.program_version()
    fitted = exported_result(result.details, out / "result.json", version)
    subjects = [Subject(material) for material in fitted.materials]
    losses: list[Loss] = []
    with staged_folder(out) as staging:
        for name in requested:
            if name == RECORD:
                result_json.write(staging / "result.json", result.details, result.stages, ())
                if result.details.varying is not None:
                    storage.write(staging / storage.NAME, result.details.varying)
            elif name == REPORT:
                for _ in write_report(staging / "report", result.details):
                    pass
            elif name in PLAIN:
                losses += PLAIN[name](staging, subjects)
            else:
                losses += _by_blender(name, staging, out, fitted, subjects)
        if losses:
            write_losses(staging, losses, ", ".join(subject.name for subject in subjects))
    return tuple(losses)


def _by_blender(*arguments: Any) -> list[Loss]:
    from .scene.export.export_formats import write_format  # needs bpy

    return write_format(*arguments)


class _FinishedFit(FitJob):
    """A finished fit, for jobs whose first stage is a fit."""

    def __init__(self, fitted: FitResult, threads: int | None) -> None:
        super().__init__(fitted.capture, basis=fitted.details.basis, threads=threads, keep=True)
        self.result = fitted.details
        self.samples = dict(fitted.samples)

    def run(self) -> Iterator[Step]:
        """Return no steps."""
        return iter(())


def _drain(job: Job, progress: Progress | None) -> None:
    """Run a job to its end, and stop its threads even if it fails or is interrupted."""
    try:
        job.drain((lambda step: None) if progress is None else progress)
    finally:
        job.close()


def _finding(cause: Mapping[str, Any]) -> Finding:
    """Convert one entry of diagnosis.json."""
    return Finding(
        cause=cause["cause"],
        sentence=cause["sentence"],
        accepted=cause["accepted"],
        contradicted=cause["contradicted"],
        gain=cause["held_out_gain"],
        standard_error=cause["standard_error"],
        p_value=cause["p_value"],
        parameters={
            name: (entry["value"], entry["standard_error"], entry["unit"])
            for name, entry in cause["parameters"].items()
        },
    )


def _check_threads(threads: int | None) -> None:
    if threads is not None and threads < 1:
        raise InputError(f"found {threads}, expected 1 or more", key="threads")
