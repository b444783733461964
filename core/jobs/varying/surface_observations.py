"""What all photos of a fit show at the nodes of a grid on its mesh, for one material at a time."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...concurrency.background import in_background
from ...concurrency.job import Step
from ...fit.measured_result import MeasuredResult
from ...inputs import capture_data
from ...varying.choice import MIN_NORMAL_ERROR, Nodes
from ...varying.corrected_observations import ObservationCorrection
from ...varying.hierarchy import MAX_TILT
from ...varying.labels import label_pixels
from ...varying.observations import Observations, observe
from ...varying.surface_grid import SurfaceGrid
from ...varying.surface_photo import SurfacePhoto
from ..fit_job import CaptureResult, MaterialResult


@dataclass(frozen=True)
class SurfaceObservations:
    """grid: on the mesh; material: (n,) index of the material of each node, −1 for vertices without
    a face; seen: observations of all nodes in all photos."""

    grid: SurfaceGrid
    material: NDArray[np.integer]
    seen: Observations

    def rows(self, index: int) -> NDArray[np.intp]:
        """The nodes of one material."""
        return np.flatnonzero(self.material == index)

    def of_material(
        self, index: int, material: MaterialResult, limit: int | None = None
    ) -> tuple[Observations, Nodes]:
        """(the observations of material ``index`` at its own nodes, numbered from 0; these nodes).
        limit: largest number of nodes, a random part of more."""
        grid, rows = self.grid, self.rows(index)
        spacing = grid.spacing
        if limit is not None and len(rows) > limit:
            spacing *= np.sqrt(len(rows) / limit)
            rows = np.sort(np.random.default_rng(0).choice(rows, limit, replace=False))
        own = self.seen.select(np.flatnonzero(self.seen.material == index))
        normals = grid.normals(rows).astype(np.float32)
        error = MIN_NORMAL_ERROR
        if isinstance(material.fit, MeasuredResult):
            error = float(np.clip(np.radians(material.fit.normal_deviation), error, MAX_TILT))
        nodes = Nodes(grid.points(rows), normals, spacing, grid.mesh_edge, error)
        return own.at_nodes(rows, len(grid)), nodes

    def with_materials(self, face_material: NDArray[np.integer]) -> SurfaceObservations:
        """The same with other materials, of the nodes too. face_material: (f,) index."""
        material = _of_nodes(self.grid, face_material)
        seen = replace(self.seen, material=material[self.seen.node].astype(np.uint8))
        return SurfaceObservations(self.grid, material, seen)

    @property
    def photos(self) -> NDArray[np.uint16]:
        """(n,) number of photos that show each node lit."""
        return np.bincount(self.seen.node, minlength=len(self.grid)).astype(np.uint16)


def observe_surface(
    fitted: CaptureResult,
    nodes: int,
    start: float,
    share: float,
    correction: ObservationCorrection | None = None,
) -> Generator[Step, None, SurfaceObservations]:
    """Read every photo at the nodes of a grid of about ``nodes`` nodes. start, share: the part of
    the job that this takes. correction: for the causes that a diagnosis named."""
    mesh, count = fitted.scan.mesh, len(fitted.capture.photos)
    grid = yield from in_background(
        lambda: SurfaceGrid.with_nodes(mesh, nodes), Step("dividing the mesh", start)
    )
    parts = []
    for place in range(count):
        step = Step("reading the surface in the photos", start + share * place / count)
        read = partial(_one, fitted, grid, place, correction)
        parts.append((yield from in_background(read, step)))
    material = _of_nodes(grid, fitted.face_material)
    return SurfaceObservations(grid, material, Observations.joined(parts))


def pixel_size(fitted: CaptureResult) -> float:
    """Median size of a pixel on the surface over all photos, scan units."""
    sizes = []
    for place in range(len(fitted.capture.photos)):
        camera = capture_data.camera_of(fitted.capture, fitted.scan, place)
        away = np.linalg.norm(fitted.rays.origin - camera.pose.centre)
        sizes.append(float(camera.footprint(np.array([away], np.float32))[0]))
    return float(np.median(sizes))


def _of_nodes(grid: SurfaceGrid, face_material: NDArray[np.integer]) -> NDArray[np.integer]:
    """(n,) material of each node, −1 for vertices without a face."""
    face = grid.places[0]
    return np.where(face >= 0, face_material[face], -1)


def _one(
    fitted: CaptureResult, grid: SurfaceGrid, place: int, correction: ObservationCorrection | None
) -> Observations:
    """The observations of one photo."""
    capture, scan = fitted.capture, fitted.scan
    camera = capture_data.camera_of(capture, scan, place)
    photo, light = fitted.photos.read(place), fitted.lights.of(capture, place)
    labels = label_pixels(capture, scan, fitted.rays, camera, place, photo, light)
    surface = SurfacePhoto(fitted.rays, camera, light, photo.radiance, labels)
    seen = observe(surface, place, grid)
    if correction is None:
        return seen
    return correction(seen, camera, grid.points(seen.node), grid.normals(seen.node))
