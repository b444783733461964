"""The job that makes texture maps over the UVs of the mesh, from a capture and its fit."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..concurrency.background import in_background
from ..concurrency.job import Job, Step
from ..geometry import RayScene
from ..inputs import capture_data
from ..inputs.lights import Lights, find_lights, refined
from ..inputs.photos import LitPhotos
from ..jobs import CaptureResult
from ..jobs.sampling import take_samples
from ..result import FittedResult
from ..samples import SampleTable
from ..scan import Mesh, Scan
from ..varying import storage
from .gather import Gathered, gather_band
from .level import MaterialLevel
from .look import PhotoSampler
from .maps_result import MapsResult, baked_maps, levels_of, notes_of, with_dielectrics
from .material import from_fit, from_result
from .normals import TurnedNormals, tangent_normals
from .refit import Paint, PaintlessFitJob, levels_without_paint, scaled
from .settle import TexelMaps, complete_maps
from .texels import Texels, check_size, rasterise

BAND = 3 << 20  # texels that are sampled at once: 100 bytes each
REFIT_SIZE = 512  # texels a side of the maps that refits use
REFITS = 2  # with the second, the error of the maps that the refit uses is a few per cent
MAX_VARIATION = (
    0.08  # standard deviation of a material's scale, relative: above it, a refit is made
)
MAX_SCALE_ERROR = 0.1  # relative error of the texels that this decision uses

Unwrap = Callable[[Mesh], NDArray[np.float32]]


@dataclass(frozen=True)
class MapsSettings:
    """size: texels a side. refits: number of refits of the BRDF to samples with the colour
    variation removed, if the colour varies over the surface. normal: make a normal map too.
    The last two have no effect on results whose variation was estimated with the fit."""

    size: int = 2048
    refits: int = REFITS
    normal: bool = False


class MapsJob(Job):
    """Make the maps of every material of a capture; ``result`` holds them when the job is done.

    unwrap: a function that makes texture coordinates (f, 3, 2) for a mesh without any; None: such
    a mesh raises InputError.
    """

    def __init__(
        self,
        capture: Capture,
        fitted: FittedResult,
        settings: MapsSettings | None = None,
        unwrap: Unwrap | None = None,
    ) -> None:
        super().__init__()
        self.capture, self.fitted = capture, fitted
        self.settings = settings or MapsSettings()
        self.unwrap = unwrap
        self.result: MapsResult | None = None

    def run(self) -> Iterator[Step]:
        """Read the scan. Where the variation was estimated with the fit, make the maps of it; else
        read the lights, sample every photo, then smooth and fill the maps."""
        capture = self.capture
        check_size(self.settings.size)
        own = from_result(capture, self.fitted)
        yield Step("reading the scan", 0.0)
        scan = capture_data.open_scan(capture)
        capture_data.check_face_attributes(capture, scan)
        capture_data.check_photos(capture, scan)
        unwrapped = scan.mesh.uv is None and self.unwrap is not None
        if unwrapped and self.unwrap is not None:
            yield Step("unwrapping the mesh", 0.01)
            scan = replace(scan, mesh=replace(scan.mesh, uv=self.unwrap(scan.mesh)))
        texels = rasterise(scan.mesh, self.settings.size)
        if self.fitted.varying is not None:
            step = Step("computing maps of the variation", 0.1)
            surface = storage.read(self.fitted.varying, scan.mesh, len(own))
            self.result = yield from in_background(
                lambda: baked_maps(capture, scan, texels, surface, own, unwrapped), step
            )
            return
        yield Step("reading the scan", 0.02)
        rays = RayScene.build(scan.mesh)
        photos = LitPhotos.open(capture)
        lights = yield from self._lights(scan, photos, rays)
        see = _PhotoInputs(capture, scan, rays, photos, lights)
        levels = levels_of(own)
        refit = yield from self._without_paint(see, texels, levels)
        if refit is not None:
            own = from_fit(refit)
            levels = levels_of(own)
        maps = yield from self._maps(see, texels, levels, 0.8, 0.16)
        own = with_dielectrics(own, levels)
        normal = None
        if self.settings.normal:
            paint = Paint(scan.mesh, texels, maps, levels)
            normal = yield from self._normal(see, paint)
        notes = notes_of(texels, levels, unwrapped, refit is not None)
        self.result = MapsResult(
            capture, scan, texels, maps, levels, own, unwrapped, refit, normal, notes
        )

    def _normal(
        self, see: _PhotoInputs, paint: Paint
    ) -> Generator[Step, None, NDArray[np.float32] | None]:
        """The normal map, from new samples with the colour variation removed."""
        tables = yield from self._samples(see, 0.96, 0.01)
        step = Step("computing the normal map", 0.97)
        yield step

        def work() -> NDArray[np.float32] | None:
            plain = [paint.removed(i, scaled(t, paint.levels[i])) for i, t in enumerate(tables)]
            turned = TurnedNormals.of(plain, paint.levels)
            if turned is None:
                return None
            return tangent_normals(
                paint.mesh, paint.texels, lambda p: turned.at_texels(paint.mesh, paint.texels, p)
            )

        return (yield from in_background(work, step))

    def _without_paint(
        self, see: _PhotoInputs, texels: Texels, levels: tuple[MaterialLevel, ...]
    ) -> Generator[Step, None, CaptureResult | None]:
        """The refit with the colour variation removed; None if the colour varies little."""
        capture, basis, rounds = self.capture, self.fitted.basis, self.settings.refits
        mesh = see.scan.mesh
        few = texels if texels.size <= REFIT_SIZE else rasterise(mesh, REFIT_SIZE)
        tables: list[SampleTable] = []
        for number in range(rounds):
            begin, share = 0.05 + 0.75 * number / rounds, 0.75 / rounds
            maps = yield from self._maps(see, few, levels, begin, 0.3 * share)
            if number == 0 and not _painted(maps, levels):
                return None
            paint = Paint(mesh, few, maps, levels)
            if number == rounds - 1:
                again = PaintlessFitJob(capture, basis, paint)
                while again.step():
                    done = begin + share * (0.3 + 0.7 * again.now.fraction)
                    yield Step(f"refitting without colour variation: {again.now.stage}", done)
                return again.result
            if not tables:
                tables = yield from self._samples(see, begin + 0.3 * share, 0.2 * share)
            steps = levels_without_paint(capture, basis, paint, tables)
            while True:
                try:
                    done = begin + share * (0.5 + 0.5 * next(steps))
                    yield Step("refitting without colour variation", done)
                except StopIteration as end:
                    levels = end.value
                    break
        return None

    def _samples(
        self, see: _PhotoInputs, begin: float, share: float
    ) -> Generator[Step, None, list[SampleTable]]:
        """The samples of all photos, one table for each material."""
        steps = take_samples(self.capture, see.scan, see.rays, see.photos, see.lights)
        while True:
            try:
                yield Step("sampling the photos", begin + share * next(steps))
            except StopIteration as end:
                kept = end.value.kept
                return [kept[m.name].table() for m in self.capture.materials]

    def _maps(
        self,
        see: _PhotoInputs,
        texels: Texels,
        levels: tuple[MaterialLevel, ...],
        begin: float,
        share: float,
    ) -> Generator[Step, None, TexelMaps]:
        """Sample all photos, one band of texels at a time, then smooth and fill the maps. Raises
        InputError where no photo shows a lit texel."""
        mesh = see.scan.mesh
        bands = [slice(i, min(i + BAND, len(texels))) for i in range(0, len(texels), BAND)]
        parts: list[Gathered] = []
        for number, band in enumerate(bands):
            looks = see.looks(levels, begin + 0.9 * share * number / len(bands),
                              0.9 * share / len(bands))  # fmt: skip
            parts.append((yield from gather_band(mesh, texels, band, looks, levels)))
        gathered = Gathered.join(parts)
        if not (gathered.scales.weight > 0).any():
            raise self.capture.error(
                "no texel is seen lit by any photo; expected the result of a fit of this capture; "
                "give that result, and check the camera poses and the lights",
                "photo", 0, "file",
            )  # fmt: skip
        yield Step("smoothing and filling the maps", begin + 0.9 * share)
        return complete_maps(mesh, texels, gathered, levels)

    def _lights(
        self, scan: Scan, photos: LitPhotos, rays: RayScene
    ) -> Generator[Step, None, Lights]:
        """The lights of the capture, refined where the capture requests it, as in the fit."""
        lights = find_lights(self.capture, scan, photos)
        if not any(entry.refine for entry in self.capture.lights):
            return lights
        steps = refined(lights, self.capture, scan, photos, rays, self.fitted.basis)
        while True:
            try:
                yield Step("refining the lights", 0.05 + 0.05 * next(steps))
            except StopIteration as end:
                found: Lights = end.value
                return found


@dataclass(frozen=True)
class _PhotoInputs:
    """The inputs for sampling texels in photos."""

    capture: Capture
    scan: Scan
    rays: RayScene
    photos: LitPhotos
    lights: Lights

    def looks(
        self, levels: tuple[MaterialLevel, ...], begin: float, share: float
    ) -> Iterator[tuple[Step, PhotoSampler]]:
        """Each photo, prepared for sampling, with the progress step to report before it."""
        capture, count = self.capture, len(self.capture.photos)
        for place in range(count):
            camera = capture_data.camera_of(capture, self.scan, place)
            photo, light = self.photos.read(place), self.lights.of(capture, place)
            look = PhotoSampler.of(
                capture, self.scan, self.rays, camera, place, photo, light, levels
            )
            yield Step("sampling texels in the photos", begin + share * place / count), look


def _painted(maps: TexelMaps, levels: tuple[MaterialLevel, ...]) -> bool:
    """True if the colour of any material varies by more than a fit of one BRDF tolerates. Judged by
    the central 68 % of the well-measured texels, so that a few wrong ones do not matter."""
    for index, (own, level) in enumerate(zip(maps.materials, levels, strict=True)):
        well = (maps.material == index) & (maps.photos > 1) & (maps.error < MAX_SCALE_ERROR)
        if not well.any():
            continue
        scale = own.scale[well] @ level.channels
        low, middle, high = np.percentile(scale, (16, 50, 84))
        noise = float(np.median(maps.error[well]))
        if (0.5 * (high - low) / max(middle, 1e-6)) ** 2 > MAX_VARIATION**2 + noise**2:
            return True
    return False
