"""What all photos of a fit show at the nodes of a grid on its mesh, for one material at a time."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...capture import Capture
from ...concurrency.background import in_background
from ...concurrency.job import Step
from ...concurrency.ordered_map import ordered_map
from ...concurrency.thread_pool import thread_count, thread_pool
from ...fit.measured_result import MeasuredResult
from ...inputs import capture_data
from ...inputs.separated_materials import without_separated
from ...varying.choice import MIN_NORMAL_ERROR, Nodes
from ...varying.corrected_observations import ObservationCorrection
from ...varying.hierarchy import MAX_TILT
from ...varying.labels import PackedLabels, label_pixels
from ...varying.observations import Observations, observe
from ...varying.surface_grid import SurfaceGrid
from ...varying.surface_photo import SurfacePhoto
from ..fit_job import CaptureResult, MaterialResult

PHOTOS_AT_ONCE = 2  # that are read: each of 24 megapixels takes some 0.5 GB


@dataclass(frozen=True)
class SurfaceObservations:
    """grid: on the mesh; material: (n,) index of the material of each node, −1 for vertices without
    a face; seen: observations of all nodes in all photos; threads: for estimates from them, None
    for one a core; labels: of the pixels of each photo."""

    grid: SurfaceGrid
    material: NDArray[np.integer]
    seen: Observations
    threads: int | None = None
    labels: tuple[PackedLabels, ...] = ()

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
        points = grid.points(rows)
        nodes = Nodes(points, normals, spacing, grid.mesh_edge, error, self.threads)
        return own.at_nodes(rows, len(grid)), nodes

    def with_materials(self, face_material: NDArray[np.integer]) -> SurfaceObservations:
        """The same with other materials, of the nodes too. face_material: (f,) index."""
        material = _of_nodes(self.grid, face_material)
        seen = replace(self.seen, material=material[self.seen.node].astype(np.uint8))
        return replace(self, material=material, seen=seen)

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
    threads: int | None = None,
    labels: Sequence[PackedLabels] = (),
    whole: Capture | None = None,
) -> Generator[Step, None, SurfaceObservations]:
    """Read every photo at the nodes of a grid of about ``nodes`` nodes. start, share: the part of
    the job that this takes. correction: for the causes that a diagnosis named. threads: None for
    one a core. labels: of the pixels of each photo, if they are known: they take most of the
    time. whole: the capture before its only material was separated into those of ``fitted``: pixels
    at their borders are used too, as what the photos show there is known, only not of which."""
    mesh, count = fitted.scan.mesh, len(fitted.capture.photos)
    grid = yield from in_background(
        lambda: SurfaceGrid.with_nodes(mesh, nodes), Step("dividing the mesh", start)
    )
    shown = fitted
    if whole is not None:
        shown = replace(fitted, capture=without_separated(fitted.capture, whole))
    parts, read = [], partial(_one, shown, grid, correction, labels)
    with thread_pool(min(thread_count(threads), PHOTOS_AT_ONCE)) as pool:
        found = ordered_map(pool, read, range(count), ahead=PHOTOS_AT_ONCE - 1)
        for place in range(count):
            step = Step("reading the surface in the photos", start + share * place / count)
            parts.append((yield from in_background(partial(next, found), step)))
    material = _of_nodes(grid, fitted.face_material)
    seen = Observations.joined([own for own, _ in parts])
    surface = SurfaceObservations(grid, material, seen, threads, tuple(own for _, own in parts))
    return surface if whole is None else surface.with_materials(fitted.face_material)


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
    fitted: CaptureResult,
    grid: SurfaceGrid,
    correction: ObservationCorrection | None,
    known: Sequence[PackedLabels],
    place: int,
) -> tuple[Observations, PackedLabels]:
    """The observations of one photo, and the labels of its pixels."""
    capture, scan = fitted.capture, fitted.scan
    camera = capture_data.camera_of(capture, scan, place)
    photo, light = fitted.photos.read(place), fitted.lights.of(capture, place)
    if known:
        packed = known[place]
        labels = packed.unpacked()
    else:
        labels = label_pixels(capture, scan, fitted.rays, camera, place, photo, light)
        packed = labels.packed()
    surface = SurfacePhoto(fitted.rays, camera, light, photo.radiance, labels)
    seen = observe(surface, place, grid)
    if correction is not None:
        seen = correction(seen, camera, grid.points(seen.node), grid.normals(seen.node))
    return seen, packed
