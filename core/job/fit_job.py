"""Capture → scan, photos, samples → a BRDF per material."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..appearance.principled_fit import PrincipledFit, fit_principled
from ..basis import Basis
from ..capture import Capture
from ..errors import FitError
from ..fit import PaperFit, fit_paper
from ..fit.held_out import HeldOut, held_out_error
from ..fit.spread import Spread, candidate_spread
from ..geometry import RayScene, view_surface
from ..samples import SampleTable, sample_photo
from ..samples.face_votes import FaceVotes
from ..samples.take import light_surface, trusted_pixels
from ..scan import Scan
from . import inputs
from .job import Job, Step


@dataclass(frozen=True)
class MaterialResult:
    """One fitted material. samples: number used; per_photo: samples of every photo."""

    name: str
    fit: PaperFit
    samples: int
    per_photo: tuple[int, ...]
    held_out: HeldOut | None
    spread: Spread
    principled: PrincipledFit
    irradiance_known: bool
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class CaptureResult:
    """Everything a fit found. face_material: (f,) int, place of each face's material."""

    capture: Capture
    scan: Scan
    rays: RayScene
    basis: Basis
    materials: tuple[MaterialResult, ...]
    face_material: np.ndarray
    warnings: tuple[str, ...]


class FitJob(Job):
    """Fit every material of a capture; ``result`` is there when the job is done."""

    def __init__(self, capture: Capture, basis: Basis | None = None) -> None:
        super().__init__()
        self.capture = capture
        self.basis = basis
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        capture = self.capture
        yield Step("reading the scan", 0.0)
        basis = self.basis or Basis.default()
        scan = inputs.open_scan(capture)
        inputs.check_face_attributes(capture, scan)
        inputs.check_photos(capture, scan)
        yield Step("reading the scan", 0.03)
        rays = RayScene.build(scan.mesh)

        tables: dict[str, list[SampleTable]] = {m.name: [] for m in capture.materials}
        votes = FaceVotes.empty(len(scan.mesh.faces), len(capture.materials))
        lit_by: dict[str, int] = {light.name: 0 for light in capture.lights}
        marked = {m.name: 0 for m in capture.materials}
        for place, photo in enumerate(capture.photos):
            yield Step("sampling the photos", 0.05 + 0.35 * place / len(capture.photos))
            view = view_surface(rays, inputs.camera_of(capture, scan, place))
            light = capture.light(photo.light)
            lighting = light_surface(rays, view, light)
            lit_by[photo.light] += int((~lighting.shadowed).sum())
            where, in_shadow = inputs.material_pixels(capture, scan, view, place)
            trusted = trusted_pixels(view, lighting, capture.fit.margins) & ~in_shadow
            radiance = inputs.radiance_of(capture, place)
            for index, material in enumerate(capture.materials):
                pixels = where[material.name]
                marked[material.name] += int(pixels.sum())
                votes.add(index, view.face[pixels])
                tables[material.name].append(
                    sample_photo(view, lighting, light, radiance, trusted & pixels)
                )
        self._check_light(lit_by)

        results = []
        for index, material in enumerate(capture.materials):
            start, share = (
                0.4 + 0.55 * index / len(capture.materials),
                0.55 / len(capture.materials),
            )
            yield Step(f"fitting {material.name}", start)
            table = SampleTable.join(tables.pop(material.name))
            self._check_samples(index, table, marked[material.name])
            try:
                fit = fit_paper(table, basis, capture.fit.paper)
            except FitError as error:
                raise capture.error(str(error), "material", index, "name") from error
            yield Step(f"predicting unseen photos of {material.name}", start + 0.4 * share)
            held = held_out_error(table, basis, capture.fit.paper) if capture.fit.held_out else None
            yield Step(f"Principled material of {material.name}", start + 0.8 * share)
            known = all(
                capture.light(photo.light).irradiance is not None for photo in capture.photos
            )
            results.append(
                MaterialResult(
                    name=material.name,
                    fit=fit,
                    samples=len(table),
                    per_photo=tuple(
                        np.bincount(table.photo, minlength=len(capture.photos)).tolist()
                    ),
                    held_out=held,
                    spread=candidate_spread(basis, fit.candidates),
                    principled=fit_principled(fit.brdf.evaluate),
                    irradiance_known=known,
                    warnings=material_warnings(table, fit, known),
                )
            )
        yield Step("materials on the mesh", 0.97)
        attributes = [m.faces for m in capture.materials if m.faces is not None]
        self.result = CaptureResult(
            capture, scan, rays, basis, tuple(results),
            scan.mesh.face_attributes[attributes[0]].clip(0, len(capture.materials) - 1)
            if attributes
            else votes.winners(scan.mesh),
            warnings=(),
        )  # fmt: skip

    def _check_light(self, lit_by: dict[str, int]) -> None:
        for place, light in enumerate(self.capture.lights):
            used = any(photo.light == light.name for photo in self.capture.photos)
            if used and lit_by[light.name] == 0:
                raise self.capture.error(
                    f"the light {light.name!r} stands behind everything its photos see: no pixel "
                    "is lit; direction points from the surface TO the light, in the scan's frame",
                    "light", place, "direction",
                )  # fmt: skip

    def _check_samples(self, index: int, table: SampleTable, marked: int) -> None:
        if len(table):
            return
        name = self.capture.materials[index].name
        painted = self.capture.named_by_masks(name)
        found = (
            f"all pixels are masked out: no mask marks any surface as {name!r}"
            if painted and marked == 0
            else f"none of the {marked} pixels of {name!r} is lit and away from shadow edges"
        )
        raise self.capture.error(found, "material", index, "name")


def material_warnings(table: SampleTable, fit: PaperFit, irradiance_known: bool) -> tuple[str, ...]:
    """What an artist should know about this material before trusting it."""
    found = list(fit.warnings)
    near_peak = int((table.theta_h < np.radians(5)).sum())
    if near_peak < 200:
        found.append(
            f"only {near_peak} samples lie within 5° of the highlight: its height is a guess; "
            "add a photo that shows the highlight"
        )
    far = float(np.percentile(table.theta_d, 98)) if len(table) else 0.0
    if far < np.radians(50):
        found.append(
            f"no photo has the light more than {2 * np.degrees(far):.0f}° from the camera: "
            "grazing reflection comes from the basis, not from this object"
        )
    if not irradiance_known:
        found.append("irradiance unknown: the BRDF is known up to one scale")
    return tuple(found)
