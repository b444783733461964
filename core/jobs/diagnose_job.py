"""Fit a capture, then search for the causes of the remaining residual."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import ClassVar, TypeVar

import numpy as np

from ..concurrency.background import steps_in_background
from ..concurrency.job import Job, Step, finished
from ..concurrency.steps import relayed
from ..concurrency.thread_pool import thread_count, thread_pool
from ..diagnose.assessment.assessment import Assessment
from ..diagnose.effects import effects_for
from ..diagnose.forward.diagnosis_context import DiagnosisContext
from ..diagnose.forward.known_variation import KnownVariation
from ..diagnose.forward.material_brdfs import MaterialBRDFs
from ..diagnose.forward.rig import Rig
from ..diagnose.pixels.pixel_selection import COUNT, select_pixels
from ..diagnose.selection.diagnosis import Diagnosis
from ..diagnose.selection.search import search
from ..fit.measured_result import MeasuredResult
from ..inputs import capture_data
from ..light import MountedLight, NearLight
from ..varying.labels import MAX_MATERIALS
from .fit_job import CaptureResult, FitJob
from .varying.node_steps import CHOICE_NODES
from .varying.separate_materials import SeparatedFit, separate_materials
from .varying.surface_observations import SurfaceObservations, observe_surface
from .varying.variation_for_diagnosis import variation_for_diagnosis

Result = TypeVar("Result")

DEFAULT_NORMAL_DEVIATION = 1.0  # degrees, of a scan's normals where the fit does not estimate it
FITTED, OBSERVED, VARIED, EXAMINED = 0.17, 0.24, 0.4, 0.42
"""Fractions of the job's time after which the materials are fitted, their surface is observed,
their variation is known, and the pixels are read, measured with a simulated capture of an even
material (field hunt, seed 3)."""
SEPARATING = 0.5  # fraction of the time until the variation is known that a separation takes
EXAMINING, TESTING = "examining the photos", "testing possible causes"


class DiagnoseJob(Job):
    """Sets ``result``, the fit; ``context``, the input of the diagnosis; and ``found``, the
    diagnosis. All are set when the job is done. ``assessment`` of the last joint fit: set by
    CheckJob, after the second fit. separate: whether a single material may be separated into
    several first (VaryingJob); ``parts`` is then the separation, and ``fit`` the fit of its
    materials. ``surface``: observations of a grid of CHOICE_NODES; None where there are more than
    MAX_MATERIALS. pixels: number of pixels that are examined, of all photos together; fewer take
    less time and show fewer causes."""

    STORED_APART: ClassVar[bool] = True

    def __init__(self, fit: FitJob, separate: bool = False, pixels: int = COUNT) -> None:
        super().__init__()
        self.fit = fit
        self.pixels = pixels
        self.separate = separate
        self.parts: SeparatedFit | None = None
        self.surface: SurfaceObservations | None = None
        fit.keep = True
        self.context: DiagnosisContext | None = None
        self.found: Diagnosis | None = None
        self.assessment: Assessment | None = None

    @property
    def result(self) -> CaptureResult | None:
        """The fit without any effect."""
        return self.fit.result

    def run(self) -> Iterator[Step]:
        """The steps of the fit, then those of the diagnosis."""
        for step in self.fit.run():
            yield Step(step.stage, FITTED * step.fraction)
        variation = yield from self._variation(finished(self.fit.result))
        result = finished(self.fit.result)
        with thread_pool(thread_count(self.fit.threads)) as pool:
            steps = context_of(result, pool, variation, self.pixels)
            self.context = yield from _stepped(steps, EXAMINING, VARIED, EXAMINED)
            yield Step(EXAMINING, EXAMINED)
            self.found = yield from _stepped(self._search(pool), TESTING, EXAMINED, 1.0)

    def _variation(self, result: CaptureResult) -> Generator[Step, None, KnownVariation | None]:
        """How the materials vary, after their separation; None where they are even, or more than
        MAX_MATERIALS."""
        if len(result.materials) > MAX_MATERIALS:
            return None
        surface = yield from observe_surface(
            result, CHOICE_NODES, FITTED, OBSERVED - FITTED, threads=self.fit.threads
        )
        start, share = OBSERVED, VARIED - OBSERVED
        if self.separate:
            part = SEPARATING * share
            self.parts = yield from separate_materials(self.fit, surface, CHOICE_NODES, start, part)
            start, share = start + part, share - part
        if self.parts is not None:
            self.fit, surface = self.parts.fit, self.parts.surface
            result = finished(self.fit.result)
        self.surface = surface
        return (yield from variation_for_diagnosis(result, surface, start, share))

    def _search(self, pool: ThreadPoolExecutor | None) -> Generator[float, None, Diagnosis]:
        result, context = finished(self.result), finished(self.context)
        tilt = float(np.radians(normal_deviation(result)))
        found = yield from search(context, tilt, effects_for(context, pool), pool)
        capture = result.capture
        names = tuple(photo.file.name for photo in capture.photos)
        if len(set(names)) < len(names):
            names = tuple(capture.photo_name(place) for place in range(len(names)))
        return replace(found, photo_names=names)


def context_of(
    result: CaptureResult,
    pool: ThreadPoolExecutor | None = None,
    variation: KnownVariation | None = None,
    count: int = COUNT,
) -> Generator[float, None, DiagnosisContext]:
    """The input of a diagnosis; yields the fraction done. variation: of the materials over the
    surface. count: pixels of all photos together. Raises what select_pixels raises."""
    capture = result.capture
    brdfs = MaterialBRDFs.of([m.fit.brdf for m in result.materials])
    rays = result.rays.close()
    scale = np.array([material.scale for material in result.materials], np.float32)
    pixels = yield from select_pixels(
        capture, result.scan, rays, result.photos, result.lights, brdfs, scale, pool, count
    )
    level = float(np.median(pixels.irradiance))
    pixels = replace(pixels, irradiance=pixels.irradiance / scale[pixels.material, None])
    names = [light.name for light in capture.lights]
    middle = pixels.point.mean(axis=0)
    return DiagnosisContext(
        pixels=pixels,
        brdfs=brdfs,
        rays=rays,
        light=np.array([names.index(photo.light) for photo in capture.photos]),
        lights=tuple(names),
        distant=np.array([light.distant for light in capture.lights]),
        rig=_rig(result),
        centre=middle,
        size=2 * float(np.percentile(np.linalg.norm(pixels.point - middle, axis=1), 99)),
        level=level,
        scale=scale,
        materials=tuple(material.name for material in result.materials),
        variation=variation,
    )


def _rig(result: CaptureResult) -> Rig:
    """Where camera and lamp of each photo are."""
    capture, photos = result.capture, len(result.capture.photos)
    rig = Rig.distant(photos)
    for place in range(photos):
        camera = capture_data.camera_of(capture, result.scan, place)
        light = result.lights.of(capture, place)
        rig.axes[place] = camera.pose.rotation
        if isinstance(light, MountedLight):
            rig.lamp[place], rig.mounted[place] = light.position(camera), True
        elif isinstance(light, NearLight):
            rig.lamp[place] = light.position
    return rig


def normal_deviation(result: CaptureResult) -> float:
    """Degrees along each tangent: standard deviation of the scan's normals, largest of all
    materials."""
    estimated = [
        m.fit.normal_deviation for m in result.materials if isinstance(m.fit, MeasuredResult)
    ]
    return max(estimated, default=DEFAULT_NORMAL_DEVIATION)


def _stepped(
    steps: Generator[float, None, Result], stage: str, begin: float, end: float
) -> Generator[Step, None, Result]:
    """Steps of one part of the diagnosis, which spans ``begin`` to ``end`` of its time."""
    return relayed(
        steps_in_background(steps),
        lambda done: Step(stage, begin + (end - begin) * done),
    )
