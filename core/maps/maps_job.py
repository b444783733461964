"""A capture and the result of its fit → maps over the mesh's texture coordinates, in steps."""

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
from .gather import Gathered, gather_band
from .level import MaterialLevel
from .look import PhotoLook
from .material import MapMaterial, from_fit, from_result
from .normals import TurnedNormals, tangent_normals
from .painted import painted_principled
from .refit import Paint, PaintlessFitJob, levels_without_paint, scaled
from .settle import TexelMaps, settle
from .texels import Texels, check_size, rasterise

BAND = 3 << 20  # texels that are gathered at once: 100 bytes each
PREVIEW = 512  # texels a side of the maps that a fit without paint is made with
REFITS = 2  # the second brings the error of what the first was made from down to a few per cent
VARIED = 0.08  # of the mean: standard deviation of a material's scale that calls for such a fit
SURE = 0.1  # relative error of texels that are asked

Unwrap = Callable[[Mesh], NDArray[np.float32]]


@dataclass(frozen=True)
class MapsSettings:
    """size: texels a side. refits: how often the BRDF is fitted again on samples without their
    paint, where the colour varies. normal: make a normal map too."""

    size: int = 2048
    refits: int = REFITS
    normal: bool = False


@dataclass(frozen=True)
class MapsResult:
    """texels: where the mesh is in the texture; maps: what was found there; levels, materials: in
    the order of the capture; unwrapped: whether the texture coordinates were made here; refit: the
    fit without paint, None where the result given was good enough; normal: (n, 3) of the texels in
    their tangent frames, None where none was asked for or the photos say nothing; notes: sentences
    for the user."""

    capture: Capture
    scan: Scan
    texels: Texels
    maps: TexelMaps
    levels: tuple[MaterialLevel, ...]
    materials: tuple[MapMaterial, ...]
    unwrapped: bool
    refit: CaptureResult | None
    normal: NDArray[np.float32] | None
    notes: tuple[str, ...]


class MapsJob(Job):
    """Maps of every material of a capture; ``result`` is there when the job is done.

    unwrap: what makes texture coordinates (f, 3, 2) for a mesh without; None: such a mesh is
    refused.
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
        """Scan and lights, then every photo, then what is between the texels."""
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
        yield Step("reading the scan", 0.02)
        rays = RayScene.build(scan.mesh)
        photos = LitPhotos.open(capture)
        lights = yield from self._lights(scan, photos, rays)
        see = _Seeing(capture, scan, rays, photos, lights)
        levels = _levels(own)
        refit = yield from self._without_paint(see, texels, levels)
        if refit is not None:
            own = from_fit(refit)
            levels = _levels(own)
        maps = yield from self._maps(see, texels, levels, 0.8, 0.16)
        own = tuple(
            replace(m, principled=painted_principled(level, m.principled))
            for m, level in zip(own, levels, strict=True)
        )
        normal = None
        if self.settings.normal:
            paint = Paint(scan.mesh, texels, maps, levels)
            normal = yield from self._normal(see, paint)
        notes = _notes(texels, levels, unwrapped, refit is not None)
        self.result = MapsResult(
            capture, scan, texels, maps, levels, own, unwrapped, refit, normal, notes
        )

    def _normal(
        self, see: _Seeing, paint: Paint
    ) -> Generator[Step, None, NDArray[np.float32] | None]:
        """The normal map, from samples taken again and rid of their paint."""
        tables = yield from self._samples(see, 0.96, 0.01)
        step = Step("normals", 0.97)
        yield step

        def work() -> NDArray[np.float32] | None:
            plain = [paint.removed(i, scaled(t, paint.levels[i])) for i, t in enumerate(tables)]
            turned = TurnedNormals.of(plain, paint.levels)
            return None if turned is None else tangent_normals(paint.mesh, paint.texels, turned)

        return (yield from in_background(work, step))

    def _without_paint(
        self, see: _Seeing, texels: Texels, levels: tuple[MaterialLevel, ...]
    ) -> Generator[Step, None, CaptureResult | None]:
        """The fit again where the colour varies, else None."""
        capture, basis, rounds = self.capture, self.fitted.basis, self.settings.refits
        mesh = see.scan.mesh
        few = texels if texels.size <= PREVIEW else rasterise(mesh, PREVIEW)
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
                    yield Step(f"without the paint: {again.now.stage}", done)
                return again.result
            if not tables:
                tables = yield from self._samples(see, begin + 0.3 * share, 0.2 * share)
            steps = levels_without_paint(capture, basis, paint, tables)
            while True:
                try:
                    done = begin + share * (0.5 + 0.5 * next(steps))
                    yield Step("without the paint: fitting", done)
                except StopIteration as end:
                    levels = end.value
                    break
        return None

    def _samples(
        self, see: _Seeing, begin: float, share: float
    ) -> Generator[Step, None, list[SampleTable]]:
        """One table a material."""
        steps = take_samples(self.capture, see.scan, see.rays, see.photos, see.lights)
        while True:
            try:
                yield Step("sampling the photos", begin + share * next(steps))
            except StopIteration as end:
                kept = end.value.kept
                return [kept[m.name].table() for m in self.capture.materials]

    def _maps(
        self,
        see: _Seeing,
        texels: Texels,
        levels: tuple[MaterialLevel, ...],
        begin: float,
        share: float,
    ) -> Generator[Step, None, TexelMaps]:
        """All photos, a band of texels at a time, then what is between the texels."""
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
                "no texel is seen lit by any photo: does the result belong to this capture?",
                "photo", 0, "file",
            )  # fmt: skip
        yield Step("between the photos", begin + 0.9 * share)
        return settle(mesh, texels, gathered, levels)

    def _lights(
        self, scan: Scan, photos: LitPhotos, rays: RayScene
    ) -> Generator[Step, None, Lights]:
        """Where the fit had them: refined where the capture says so."""
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
class _Seeing:
    """What a photo is looked at with."""

    capture: Capture
    scan: Scan
    rays: RayScene
    photos: LitPhotos
    lights: Lights

    def looks(
        self, levels: tuple[MaterialLevel, ...], begin: float, share: float
    ) -> Iterator[tuple[Step, PhotoLook]]:
        """One photo after the other, with what is to be told before it."""
        capture, count = self.capture, len(self.capture.photos)
        for place in range(count):
            camera = capture_data.camera_of(capture, self.scan, place)
            photo, light = self.photos.read(place), self.lights.of(capture, place)
            look = PhotoLook.of(capture, self.scan, self.rays, camera, place, photo, light, levels)
            yield Step("texels in the photos", begin + share * place / count), look


def _levels(materials: tuple[MapMaterial, ...]) -> tuple[MaterialLevel, ...]:
    return tuple(MaterialLevel.of(m.name, m.brdf, m.scale, m.normal_deviation) for m in materials)


def _painted(maps: TexelMaps, levels: tuple[MaterialLevel, ...]) -> bool:
    """Whether any material's colour varies by more than a fit without maps puts up with: most of
    its well-seen texels, not a few that something else is wrong with."""
    for index, (own, level) in enumerate(zip(maps.materials, levels, strict=True)):
        well = (maps.material == index) & (maps.photos > 1) & (maps.error < SURE)
        if not well.any():
            continue
        scale = own.scale[well] @ level.channels
        low, middle, high = np.percentile(scale, (16, 50, 84))
        told = float(np.median(maps.error[well]))
        if (0.5 * (high - low) / max(middle, 1e-6)) ** 2 > VARIED**2 + told**2:
            return True
    return False


def _notes(
    texels: Texels, levels: tuple[MaterialLevel, ...], unwrapped: bool, refitted: bool
) -> tuple[str, ...]:
    said = []
    if refitted:
        said.append(
            "the colour varies over the surface: the BRDF was fitted again without it, and that "
            "fit is written beside the maps; its held-out errors are those of photos without paint"
        )
    if unwrapped:
        said.append("the mesh had no texture coordinates: Blender's Smart UV Project made some")
    if texels.overlapped:
        share = 100 * texels.overlapped / len(texels)
        said.append(
            f"{share:.1f} % of the texels are claimed by more than one face (overlapping UVs): the "
            "first of them is shown"
        )
    if texels.outside:
        said.append(
            f"{texels.outside:,} faces have texture coordinates outside of 0 … 1: they have no map"
        )
    said += [
        f"{level.name}: {100 * level.split.share:.0f} % of what it reflects is diffuse: too little "
        "to map, so its whole reflectance varies"
        for level in levels
        if level.split.whole
    ]
    return tuple(said)
