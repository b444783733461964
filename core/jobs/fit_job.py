"""The fit of a capture: read scan and photos, take samples, fit one BRDF per material."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..appearance.lobe_fit import LobeStackFit
from ..appearance.principled_fit import PrincipledFit
from ..basis import Basis, default_basis
from ..capture import Capture
from ..concurrency.background import in_background
from ..concurrency.job import Job, Step, finished
from ..concurrency.steps import relayed
from ..counted import counted
from ..errors import FitError, InputError
from ..fit import PaperFit
from ..fit.fit_quality import FitQuality
from ..fit.held_out import HeldOutErrors, Judge
from ..fit.measured_result import MeasuredResult
from ..fit.spread import Spread
from ..geometry import RayScene
from ..inputs import capture_data
from ..inputs.lights import Lights, find_lights, refined
from ..inputs.photos import LitPhotos
from ..proposed_photo import ProposedPhoto
from ..samples import MeasuredPoints, SampleSink, SampleTable
from ..samples.level import multiplied, typical_factor
from ..scan import Scan
from ..varying.varying_surface import VaryingSurface
from .applied_effects import AppliedEffect
from .axis_exchange import better_axes, with_axes
from .estimators import Estimate, estimate
from .face_assignment import face_materials
from .fit_times import ASSIGNING, FitTimes
from .fit_warnings import black_photo_warnings, material_warnings, quality_warnings
from .portable_materials import Portable, fit_portable
from .proposed_photo import proposed_photo
from .sample_checks import check_light, check_samples, material_entry
from .sampling import PhotoSamples, take_samples

AXES_ERROR = 0.3  # typical error of held-out photos from which other axes of the mesh are tried


@dataclass(frozen=True)
class MaterialResult:
    """One fitted material.

    fit: by the method that the capture selects. samples: number of samples taken from the photos;
    used: number of samples that the fit used (all, unless there are too many); per_photo: samples
    taken from each photo; points: a subset of them, for charts. scale: factor applied to the
    reflectance, 1 where the irradiance is known. portable: the material as other renderers show
    it, None until it is computed. warnings: sentences for the user.
    """

    name: str
    fit: PaperFit | MeasuredResult
    samples: int
    used: int
    per_photo: tuple[int, ...]
    points: MeasuredPoints
    held_out: HeldOutErrors | None
    spread: Spread
    portable: Portable | None
    scale: float
    irradiance_known: bool
    warnings: tuple[str, ...]

    @property
    def quality(self) -> FitQuality:
        """How good the fit is, by its error on held-out photos."""
        return FitQuality(None if self.held_out is None else self.held_out.typical)

    @property
    def principled(self) -> PrincipledFit:
        """The Principled BSDF that approximates the BRDF best."""
        return finished(self.portable).principled

    @property
    def lobes(self) -> LobeStackFit:
        """The stack of lobes that approximates the BRDF best."""
        return finished(self.portable).lobes


@dataclass(frozen=True)
class CaptureResult:
    """Everything that a fit found.

    face_material: (f,) int, index into ``materials`` for each face. notes: what was read, assumed
    and left out, one sentence each. effects: causes found by a diagnosis that the materials take
    into account. varying: how the materials vary over the surface, None where they are even or
    where this was not estimated. proposed_photo: the photo that would say most about the materials.
    """

    STORED_APART: ClassVar[bool] = True

    capture: Capture
    scan: Scan
    photos: LitPhotos
    lights: Lights
    notes: tuple[str, ...]
    rays: RayScene
    basis: Basis
    materials: tuple[MaterialResult, ...]
    face_material: NDArray[np.int32]
    effects: tuple[AppliedEffect, ...] = ()
    varying: VaryingSurface | None = None
    proposed_photo: ProposedPhoto | None = None


def with_portable(
    material: MaterialResult, start: float, threads: int | None
) -> Generator[Step, None, MaterialResult]:
    """The material with its portable form, computed if it is missing.

    start: fraction of the job that is done before this step. threads: None for one per core.
    """
    if material.portable is not None:
        return material
    found = yield from fit_portable(material.fit.brdf, material.name, start, threads)
    warnings = material.warnings
    if found.principled.clipped:
        warnings += (
            "The material is brighter than any base colour can be. Its Principled BSDF is too "
            "dark.",
        )
    return replace(material, portable=found, warnings=warnings)


def with_proposed_photo(
    result: CaptureResult, start: float
) -> Generator[Step, None, CaptureResult]:
    """The result with the photo that would say most about its materials. start: fraction of the job
    that is done before this step."""
    fits = [material.fit for material in result.materials]
    found = yield from in_background(
        lambda: proposed_photo(result.scan, result.rays, result.lights, fits, result.face_material),
        Step("choosing the next photo", start),
    )
    return replace(result, proposed_photo=found)


class FitJob(Job):
    """Fit every material of a capture; ``result`` is set when the job is done.

    basis: the basis of the fit, or a function that returns it and runs in the background (None:
    the embedded basis). prepare: called with the scan after it is read, to add face attributes
    that no file has. threads: number of threads that sample the photos (None: one per core); the
    result does not depend on it. keep: whether ``samples`` keeps the samples that each material
    was fitted to, by material name, and ``limits`` the clipped ones. portable: whether to fit the
    portable forms and to propose the next photo, too.
    """

    def __init__(
        self,
        capture: Capture,
        basis: Basis | Callable[[], Basis] | None = None,
        prepare: Callable[[Scan], Scan] | None = None,
        threads: int | None = None,
        keep: bool = False,
        portable: bool = True,
    ) -> None:
        super().__init__()
        self.threads = threads
        self.keep = keep
        self.portable = portable
        self.samples: dict[str, SampleTable] = {}
        self.limits: dict[str, SampleTable] = {}
        self.capture = capture
        self.basis = basis
        self.prepare = prepare
        self.result: CaptureResult | None = None
        self._times = FitTimes.of(1, 0, [0], portable)

    def run(self) -> Iterator[Step]:
        """Read the scan and the photos, then fit one material after the other."""
        capture = self.capture
        yield Step("reading the scan", 0.0)
        if isinstance(self.basis, Basis) or self.basis is None:
            basis = self.basis or (
                yield from in_background(default_basis, Step("reading the scan", 0.0))
            )
        else:
            basis = yield from in_background(self.basis, Step("computing the basis", 0.0))
        scan = yield from in_background(
            lambda: capture_data.open_scan(capture), Step("reading the scan", 0.0)
        )
        if self.prepare is not None:
            scan = self.prepare(scan)
        capture_data.check_face_attributes(capture, scan)
        capture_data.check_photos(capture, scan)
        pixels = _pixels(capture, scan)
        self._times = FitTimes.before_sampling(
            len(capture.photos), pixels, len(capture.materials), self.portable
        )
        read = Step("reading the scan", 0.5 * self._times.read)
        yield read
        rays = yield from in_background(lambda: RayScene.build(scan.mesh), read)
        photos = LitPhotos.open(capture)
        lights = find_lights(capture, scan, photos)
        if any(entry.refine for entry in capture.lights):
            lights = yield from relayed(
                refined(lights, capture, scan, photos, rays, basis),
                lambda done: Step("refining the lights", (0.5 + 0.5 * done) * self._times.read),
            )
        known = lights.known and capture.fit.absolute
        taken = yield from self._take_samples(scan, rays, photos, lights)
        counts = [int(taken.counts[material.name].sum()) for material in capture.materials]
        tables, clipped = taken.tables([material.name for material in capture.materials])
        comparing = Step("comparing the axes of the mesh", self._times.sampled)
        try:
            check_light(capture, taken)
            for index, material in enumerate(capture.materials):
                check_samples(capture, index, tables[index], taken.marked[material.name], known)
        except InputError as error:
            found = error
            raise (
                yield from in_background(
                    lambda: with_axes(found, capture, scan, rays, photos, lights), comparing
                )
            ) from error
        self._times = FitTimes.of(len(capture.photos), pixels, counts, self.portable)
        results: list[MaterialResult] = []
        unit = known, 1.0 if known else typical_factor(tables, basis)
        for index, material in enumerate(capture.materials):
            table, limits = (multiplied(t.pop(0), unit[1]) for t in (tables, clipped))
            if self.keep:
                self.samples[material.name], self.limits[material.name] = table, limits
            start, share = self._times.material(index)
            yield Step(f"fitting {material.name}", start)
            each = taken.counts[material.name]
            results.append(
                (yield from self._material(index, table, basis, unit, each, start, share, limits))
            )
        odd = [m.held_out is not None and m.held_out.typical > AXES_ERROR for m in results]
        if any(odd):
            hint = yield from in_background(
                lambda: better_axes(capture, scan, rays, photos, lights),
                replace(comparing, fraction=1 - ASSIGNING / self._times.total),
            )
            results = [
                replace(material, warnings=(hint, *material.warnings))
                if hint and large
                else material
                for material, large in zip(results, odd, strict=True)
            ]
        end = 1 - ASSIGNING / self._times.total
        yield Step("assigning materials to the mesh", end)
        result = CaptureResult(
            capture=capture,
            scan=scan,
            photos=photos,
            lights=lights,
            notes=(
                *scan.notes,
                *(f"{counted(n, 'photo')}: {note}" for note, n in taken.notes.items()),
                *photos.notes,
                *lights.notes,
                *capture_data.unused_settings(capture),
                *capture_data.size_notes(capture, scan),
            ),
            rays=rays,
            basis=basis,
            materials=tuple(results),
            face_material=face_materials(capture, scan, taken.votes),
        )
        if self.portable:
            result = yield from with_proposed_photo(result, end)
        self.result = result

    def _take_samples(
        self, scan: Scan, rays: RayScene, photos: LitPhotos, lights: Lights
    ) -> Generator[Step, None, PhotoSamples]:
        """Sample all photos; each material's samples go to its sinks as they are taken."""
        sinks = {material.name: self.sinks(material.name) for material in self.capture.materials}
        read, sampled = self._times.read, self._times.sampled
        return (
            yield from relayed(
                take_samples(self.capture, scan, rays, photos, lights, sinks, self.threads),
                lambda done: Step("sampling the photos", read + (sampled - read) * done),
            )
        )

    def samples_to_fit(self, index: int, table: SampleTable) -> SampleTable:
        """The samples that a material is fitted to, from all of its samples. Subclasses override
        it."""
        return table

    def limits_to_fit(self, index: int, clipped: SampleTable | None) -> SampleTable | None:
        """The clipped samples that a material is fitted to, from all of them. Subclasses override
        it."""
        return clipped

    def sinks(self, material: str) -> Sequence[SampleSink]:
        """The sinks that get all samples of a material, in addition to the reservoir."""
        return ()

    def fit_again(
        self,
        index: int,
        table: SampleTable,
        before: MaterialResult,
        start: float,
        share: float,
        judge: Judge | None = None,
        clipped: SampleTable | None = None,
    ) -> Generator[Step, None, MaterialResult]:
        """Fit a material again to other samples, in the same unit as before.

        index: of the material; before: its result so far. start, share: the part of the job that
        this takes. judge: predicts a held-out photo and measures the error (None: from
        ``table``). clipped: samples with a clipped channel, in addition.
        """
        basis, counts = finished(self.result).basis, np.array(before.per_photo)
        unit = before.irradiance_known, before.scale
        steps = self._material(index, table, basis, unit, counts, start, share, clipped, judge)
        return (yield from steps)

    def _material(
        self,
        index: int,
        table: SampleTable,
        basis: Basis,
        unit: tuple[bool, float],
        counts: NDArray[np.int64],
        start: float,
        share: float,
        clipped: SampleTable | None,
        judge: Judge | None = None,
    ) -> Generator[Step, None, MaterialResult]:
        """Fit one material. unit: (whether the irradiance is known, scale of the samples); counts:
        (photos,) samples taken from each photo; clipped: its samples with a clipped channel."""
        capture, name = self.capture, self.capture.materials[index].name
        known, scale = unit
        fit_share = share * (self._times.fit_share(index) if self.portable else 1.0)
        found = yield from self._estimate(index, table, basis, start, fit_share, clipped, judge)
        # the most severe first: what makes the result wrong, then what makes it uncertain
        warnings = black_photo_warnings(table, capture) + quality_warnings(found, capture)
        warnings += material_warnings(table, found.fit, known) + found.notes
        material = MaterialResult(
            name=name,
            fit=found.fit,
            samples=int(counts.sum()),
            used=len(table),
            per_photo=tuple(counts.tolist()),
            points=MeasuredPoints.of(table),
            held_out=found.held_out,
            spread=found.spread,
            portable=None,
            scale=scale,
            irradiance_known=known,
            warnings=warnings,
        )
        if not self.portable:
            return material
        return (yield from with_portable(material, start + fit_share, self.threads))

    def _estimate(
        self,
        index: int,
        table: SampleTable,
        basis: Basis,
        start: float,
        share: float,
        clipped: SampleTable | None,
        judge: Judge | None = None,
    ) -> Generator[Step, None, Estimate]:
        """Run the estimator; it takes the fraction ``share`` of the job from ``start`` on."""
        name = self.capture.materials[index].name
        samples_to_fit = yield from in_background(
            lambda: self.samples_to_fit(index, table), Step(f"fitting {name}", start)
        )
        limits = self.limits_to_fit(index, clipped)
        steps = estimate(samples_to_fit, basis, self.capture, name, judge, limits)
        while True:
            try:
                stage, done = next(steps)
            except StopIteration as end:
                found: Estimate = end.value
                return found
            except FitError as error:
                raise self.capture.error(
                    str(error), *material_entry(self.capture, index)
                ) from error
            yield Step(stage, start + share * done)


def _pixels(capture: Capture, scan: Scan) -> int:
    """The number of pixels of all lit photos."""
    cameras = (capture_data.camera_of(capture, scan, k) for k in range(len(capture.photos)))
    return sum(camera.width * camera.height for camera in cameras)
