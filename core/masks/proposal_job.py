"""The job that proposes materials for the faces of a capture from its photos."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..basis import Basis, default_basis
from ..capture import Capture
from ..concurrency.job import Job, Step
from ..concurrency.steps import drained
from ..errors import FitError
from ..geometry import RayScene, view_surface
from ..inputs import capture_data
from ..inputs.lights import Lights, find_lights, refined
from ..inputs.material_pixels import material_pixels
from ..inputs.photos import LitPhotos
from ..samples import sample_photo
from ..samples.level import at_typical_level
from ..samples.take import light_surface, trusted_pixels
from ..scan import Scan
from .proposal import Proposal, propose_materials
from .proposal_cells import Cells


@dataclass(frozen=True)
class ProposalResult:
    """The result of a ProposalJob: the proposal, and the inputs that it has read."""

    scan: Scan
    rays: RayScene
    lights: Lights
    photos: LitPhotos
    proposal: Proposal


def capture_lights(
    capture: Capture, scan: Scan, photos: LitPhotos, rays: RayScene, basis: Basis
) -> Lights:
    """The lights of the capture, refined where it requests this, with a single material for the
    whole surface."""
    lights = find_lights(capture, scan, photos)
    if any(entry.refine for entry in capture.lights):
        lights = drained(refined(lights, capture, scan, photos, rays, basis))
    return lights


class ProposalJob(Job):
    """Propose materials for a capture; ``result`` holds them when the job is done.

    count: the number of materials; None: as many as differ significantly.
    """

    def __init__(
        self, capture: Capture, count: int | None = None, basis: Basis | None = None
    ) -> None:
        super().__init__()
        self.capture, self.count, self.basis = capture, count, basis
        self.result: ProposalResult | None = None

    def run(self) -> Iterator[Step]:
        """Read the scan, sample the photos, then cluster the surface."""
        capture = self.capture
        yield Step("reading the scan", 0.0)
        basis = self.basis or default_basis()
        scan = capture_data.open_scan(capture)
        capture_data.check_photos(capture, scan)
        rays = RayScene.build(scan.mesh)
        photos = LitPhotos.open(capture)
        lights = capture_lights(capture, scan, photos, rays, basis)
        parts: list[Cells] = []
        factor: float | None = None if not lights.known else 1.0
        for place in range(len(capture.photos)):
            yield Step("sampling the photos", 0.05 + 0.7 * place / len(capture.photos))
            camera = capture_data.camera_of(capture, scan, place)
            view = view_surface(rays, camera)
            if not len(view.pixel):
                continue
            lighting = light_surface(rays, view, lights.of(capture, place), camera)
            _, in_shadow = material_pixels(
                capture, scan, view, capture_data.photo_masks(capture, place)
            )
            keep = trusted_pixels(view, lighting, capture.fit.margins) & ~in_shadow
            lit = photos.read(place)
            keep &= lit.usable.ravel()[view.pixel]
            if not keep.any():
                continue
            table = sample_photo(view, lighting, lit.radiance, keep)
            if factor is None:  # unknown irradiance: one factor for all photos, to a typical level
                table, factor = at_typical_level(table, basis)
            elif factor != 1.0:
                table = replace(table, rho=table.rho * np.float32(factor))
            parts.append(Cells.of(table, view.face[keep], place, basis))
        if not parts:
            raise self.capture.error(
                "no photo shows a lit part of the mesh; expected photos that show it; check the "
                "camera poses and the lights",
                "scan",
                "mesh",
            )
        yield Step("separating the materials", 0.8)
        try:
            names = [light.name for light in capture.lights]
            lamps = [names.index(photo.light) for photo in capture.photos]
            if any(light.mounted is not None for light in capture.lights):
                lamps = list(
                    range(len(capture.photos))
                )  # a mounted light is at another place in each photo
            proposal = propose_materials(Cells.join(parts), scan.mesh, self.count, lamps)
        except FitError as error:
            raise self.capture.error(str(error), "scan", "mesh") from error
        self.result = ProposalResult(scan, rays, lights, photos, proposal)
