"""Capture → scan, photos, samples → a BRDF per material."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..appearance.principled_fit import PrincipledFit, fit_principled
from ..basis import Basis
from ..capture import Capture, LightEntry
from ..errors import FitError
from ..fit import PaperFit, fit_paper
from ..fit.held_out import HeldOut, leave_out, photos_to_hold_out, summarise
from ..fit.spread import Spread, candidate_spread
from ..geometry import RayScene, edges, view_surface
from ..samples import SampleTable, sample_photo
from ..samples.face_votes import FaceVotes
from ..samples.level import at_typical_level
from ..samples.take import light_surface, trusted_pixels
from ..scan import Scan
from . import inputs
from .job import Job, Step
from .lights import Lights, find_lights, refined
from .photos import LitPhotos
from .warnings import black_photos, material_warnings, trust_warnings

MANY_CLIPPED = 1e-3  # of a photo's lit pixels
LEAST_RHO, LARGEST_RHO = 1e-6, 1e4  # 1/sr: black velvet has 1e-3, mirrors' peaks 1e4


@dataclass(frozen=True)
class MaterialResult:
    """One fitted material. samples: number used; per_photo: samples of every photo; scale: what
    the photos' reflectance was multiplied by, 1 where the irradiance is known."""

    name: str
    fit: PaperFit
    samples: int
    per_photo: tuple[int, ...]
    held_out: HeldOut | None
    spread: Spread
    principled: PrincipledFit
    scale: float
    irradiance_known: bool
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class CaptureResult:
    """Everything a fit found. face_material: (f,) int, place of each face's material; notes: what
    was read, assumed and left out, a sentence each."""

    capture: Capture
    scan: Scan
    photos: LitPhotos
    lights: Lights
    notes: tuple[str, ...]
    rays: RayScene
    basis: Basis
    materials: tuple[MaterialResult, ...]
    face_material: NDArray[np.int32]


@dataclass(frozen=True)
class _Taken:
    """Samples of every material, photo by photo; surface pixels its masks mark; faces' votes;
    what was noted while reading, and of how many photos."""

    tables: dict[str, list[SampleTable]]
    marked: dict[str, int]
    votes: FaceVotes
    notes: Counter[str]


def _way(entry: LightEntry) -> str:
    """The key that says where a light is."""
    ways = ("sphere", "sun", "position", "mounted")
    return next((way for way in ways if getattr(entry, way) is not None), "direction")


class FitJob(Job):
    """Fit every material of a capture; ``result`` is there when the job is done.

    prepare: what is done to the scan once it is read (face attributes that no file has).
    """

    def __init__(
        self,
        capture: Capture,
        basis: Basis | None = None,
        prepare: Callable[[Scan], Scan] | None = None,
    ) -> None:
        super().__init__()
        self.capture = capture
        self.basis = basis
        self.prepare = prepare
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        """Scan, photos, then one material after the other."""
        capture = self.capture
        yield Step("reading the scan", 0.0)
        basis = self.basis or Basis.default()
        scan = inputs.open_scan(capture)
        if self.prepare is not None:
            scan = self.prepare(scan)
        inputs.check_face_attributes(capture, scan)
        inputs.check_photos(capture, scan)
        yield Step("reading the scan", 0.03)
        rays = RayScene.build(scan.mesh)
        photos = LitPhotos.open(capture)
        lights = find_lights(capture, scan, photos)
        if any(entry.refine for entry in capture.lights):
            steps = refined(lights, capture, scan, photos, rays, basis)
            while True:
                try:
                    yield Step("refining the lights", 0.03 + 0.02 * next(steps))
                except StopIteration as end:
                    lights = end.value
                    break
        taken = yield from self._take_samples(scan, rays, photos, lights)
        results = []
        known = lights.known and capture.fit.absolute
        for index in range(len(capture.materials)):
            results.append((yield from self._fit_material(index, taken, basis, known)))
        yield Step("materials on the mesh", 0.97)
        self.result = CaptureResult(
            capture=capture,
            scan=scan,
            photos=photos,
            lights=lights,
            notes=(
                *scan.notes,
                *(f"{n} photo{'s' * (n > 1)}: {said}" for said, n in taken.notes.items()),
                *photos.notes,
                *lights.notes,
                *inputs.size_notes(capture, scan),
            ),
            rays=rays,
            basis=basis,
            materials=tuple(results),
            face_material=self._face_material(scan, taken.votes),
        )

    def _take_samples(
        self, scan: Scan, rays: RayScene, photos: LitPhotos, lights: Lights
    ) -> Generator[Step, None, _Taken]:
        capture = self.capture
        taken = _Taken(
            tables={m.name: [] for m in capture.materials},
            marked={m.name: 0 for m in capture.materials},
            votes=FaceVotes.empty(len(scan.mesh.faces), len(capture.materials)),
            notes=Counter(),
        )
        lit_by = {light.name: 0 for light in capture.lights}
        seen_by = {light.name: 0 for light in capture.lights}
        for place, photo in enumerate(capture.photos):
            yield Step("sampling the photos", 0.05 + 0.35 * place / len(capture.photos))
            camera = inputs.camera_of(capture, scan, place)
            view = view_surface(rays, camera)
            lighting = light_surface(rays, view, lights.of(capture, place), camera)
            seen_by[photo.light] += len(view.pixel)
            lit_by[photo.light] += int((~lighting.shadowed).sum())
            where, in_shadow = inputs.material_pixels(capture, scan, view, place)
            trusted = trusted_pixels(view, lighting, capture.fit.margins) & ~in_shadow
            lit = photos.read(place)
            usable = lit.usable.ravel()[view.pixel]
            clipped = int((trusted & ~usable).sum())
            if clipped > MANY_CLIPPED * trusted.sum():
                taken.notes[
                    "lit pixels are clipped and left out: highlights are missing; expose less, or "
                    "take a bracket"
                ] += 1
            trusted &= usable
            taken.notes.update(lit.notes)
            for index, material in enumerate(capture.materials):
                pixels = where[material.name]
                taken.marked[material.name] += int(pixels.sum())
                taken.votes.add(index, view.face[pixels])
                part = view.image(pixels, fill=0).astype(bool)
                inner = edges.inside(part, view.seen, capture.fit.margins.mask)
                keep = trusted & inner.ravel()[view.pixel]
                taken.tables[material.name].append(sample_photo(view, lighting, lit.radiance, keep))
        self._check_light(seen_by, lit_by)
        return taken

    def _fit_material(
        self, index: int, taken: _Taken, basis: Basis, known: bool
    ) -> Generator[Step, None, MaterialResult]:
        capture = self.capture
        name = capture.materials[index].name
        share = 0.55 / len(capture.materials)
        start = 0.4 + share * index
        yield Step(f"fitting {name}", start)
        table = SampleTable.join(taken.tables.pop(name))
        self._check_samples(index, table, taken.marked[name], known)
        scale = 1.0
        if not known:
            table, scale = at_typical_level(table, basis)
        try:
            fit = fit_paper(table, basis, capture.fit.paper)
        except FitError as error:
            raise capture.error(str(error), *self._entry(index)) from error
        left_out = []
        unseen = photos_to_hold_out(table) if capture.fit.held_out else []
        for done, photo in enumerate(unseen):
            yield Step(
                f"predicting unseen photos of {name}",
                start + share * (0.3 + 0.5 * done / len(unseen)),
            )
            left_out.append(leave_out(table, photo, basis, capture.fit.paper))
        yield Step(f"Principled material of {name}", start + 0.8 * share)
        principled = fit_principled(fit.brdf.evaluate)
        held = summarise([part for part in left_out if part is not None])
        spread = candidate_spread(basis, fit.candidates)
        warnings = material_warnings(table, fit, known)
        warnings += trust_warnings(held, spread, capture)
        warnings += tuple(
            f"{capture.photo_name(photo)} is black where its light should reach: is this the "
            "camera it was taken with, and this its light?"
            for photo in black_photos(table)
        )
        if None in left_out:
            lost = [
                capture.photo_name(photo)
                for photo, part in zip(unseen, left_out, strict=True)
                if part is None
            ]
            warnings += (f"without {', '.join(lost)} too little is left to fit",)
        if principled.clipped:
            warnings += ("brighter than any base colour: the Principled material is too dark",)
        return MaterialResult(
            name=name,
            fit=fit,
            samples=len(table),
            per_photo=tuple(np.bincount(table.photo, minlength=len(capture.photos)).tolist()),
            held_out=held,
            spread=spread,
            principled=principled,
            scale=scale,
            irradiance_known=known,
            warnings=warnings,
        )

    def _face_material(self, scan: Scan, votes: FaceVotes) -> NDArray[np.int32]:
        """What masks say, and over it what the mesh says where a material is given by its faces."""
        found = votes.winners(scan.mesh)
        for index, material in enumerate(self.capture.materials):
            attribute = inputs.face_attribute(material)
            if attribute is not None:
                found[scan.mesh.face_attributes[attribute] == index] = index
        return found

    def _check_light(self, seen_by: dict[str, int], lit_by: dict[str, int]) -> None:
        if not any(seen_by.values()):
            raise self.capture.error("no lit photo shows any of the mesh", "scan", "mesh")
        for place, light in enumerate(self.capture.lights):
            if seen_by[light.name] and lit_by[light.name] == 0:
                raise self.capture.error(
                    f"the light {light.name!r} stands behind everything its photos see: no pixel "
                    "is lit; "
                    + (
                        "direction points from the surface TO the light, in the scan's frame"
                        if light.distant
                        else "expected its place outside the object, in scan units"
                    ),
                    "light", place, _way(light),
                )  # fmt: skip

    def _check_samples(self, index: int, table: SampleTable, marked: int, known: bool) -> None:
        name = self.capture.materials[index].name
        if len(table):
            level = float(np.median(table.rho))
            if level <= 0 or (known and not LEAST_RHO < level < LARGEST_RHO):
                raise self.capture.error(
                    f"the typical reflectance of {name!r} is {level:.3g} / sr, which no surface "
                    "has: check that light directions point from the surface TO the light, that "
                    "the photos are linear and not black, exposure and irradiance",
                    *self._entry(index),
                )
            return
        painted = self.capture.named_by_masks(name)
        found = (
            f"all pixels are masked out: no mask marks any surface as {name!r}"
            if painted and marked == 0
            else f"none of the {marked} pixels of {name!r} is lit and away from shadow edges"
        )
        raise self.capture.error(found, *self._entry(index))

    def _entry(self, index: int) -> tuple[str | int, ...]:
        """The key to speak of a material: its own, or the photos' where the file names none."""
        own = ("material", index, "name")
        return own if own in self.capture.lines else ("photo", 0, "file")
