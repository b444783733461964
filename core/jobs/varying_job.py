"""Estimate how the materials of a fit vary over the surface."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..concurrency.background import in_background, steps_in_background
from ..concurrency.job import Job, Step
from ..concurrency.steps import relayed
from ..fit.measured_result import MeasuredResult
from ..inputs import capture_data
from ..varying.choice import Nodes, choose
from ..varying.hierarchy import edges_of_levels, solve
from ..varying.labels import label_pixels
from ..varying.level import MaterialLevel
from ..varying.node_model import COUNT, NodeModel
from ..varying.observations import Observations, observe
from ..varying.surface_grid import SurfaceGrid
from ..varying.surface_photo import SurfacePhoto
from ..varying.varying_surface import VARIATIONS, MaterialVariation, VaryingSurface
from .fit_job import CaptureResult

MODES = ("auto", "never", "always")
MAX_NODES = 2_000_000
"""Nodes of a grid. Each takes 60 bytes for every photo that shows it."""
MAX_OBSERVATIONS = 40_000_000  # nodes times photos: 2.4 GB
CHOICE_NODES = 100_000  # of the grid that the choice uses
READ, CHOSEN = 0.15, 0.6  # fractions of the time after which photos are read and kinds are chosen


class VaryingJob(Job):
    """Sets ``result`` when the job is done: None where every material is even, as "auto" finds by
    held-out photos; ``notes``: sentences for the user.

    mode: "auto", or "always" for all that can vary.
    """

    def __init__(self, fitted: CaptureResult, mode: str = "auto", nodes: int = MAX_NODES) -> None:
        super().__init__()
        self.fitted, self.mode, self.nodes = fitted, mode, nodes
        self.result: VaryingSurface | None = None
        self.notes: tuple[str, ...] = ()

    def run(self) -> Iterator[Step]:
        """Choose what varies on a coarse grid, then estimate it on a fine one."""
        models = tuple(_model(self.fitted, index) for index in range(len(self.fitted.materials)))
        everything = list(VARIATIONS)[-1]
        kinds = tuple(MaterialVariation(everything, {}) for _ in models)
        start = 0.0
        if self.mode == "auto":
            kinds, start = (yield from self._chosen(models)), CHOSEN
        self.notes = tuple(
            _sentence(material.name, kind)
            for material, kind in zip(self.fitted.materials, kinds, strict=True)
        )
        if all(kind.kind == "even" for kind in kinds):
            return
        photos = len(self.fitted.capture.photos)
        grid = yield from in_background(
            lambda: SurfaceGrid.with_nodes(
                self.fitted.scan.mesh, min(self.nodes, MAX_OBSERVATIONS // max(photos, 1))
            ),
            Step("dividing the mesh", start),
        )
        seen = yield from self._observed(grid, start, READ * (1 - start))
        begin = start + READ * (1 - start)
        n = len(grid)
        parameters, variance = (np.zeros((n, COUNT), np.float32) for _ in range(2))
        material = self._materials(grid)
        for index, model in enumerate(models):
            free = np.zeros(COUNT, bool)
            free[list(VARIATIONS[kinds[index].kind])] = True
            rows = np.flatnonzero(material == index)
            own = _of_material(seen, rows, index, n)
            if not free.any() or not len(own):
                continue
            points, normals = grid.points(rows), grid.normals(rows).astype(np.float32)
            share = (1 - begin) / len(models)
            steps = solve(model, own, points, normals, edges_of_levels(points, grid.spacing), free)
            step = Step("estimating the variation", begin + index * share)
            while True:
                found = yield from in_background(lambda s=steps: next(s, None), step)  # type: ignore[misc]
                if found is None:
                    break
                done, fields = found
                step = Step("estimating the variation", begin + (index + done) * share)
            parameters[rows], variance[rows] = fields.parameters, fields.variance
        photos_of = np.bincount(seen.node, minlength=n).astype(np.uint16)
        self.result = VaryingSurface(grid, parameters, np.sqrt(variance), photos_of, kinds)

    def _chosen(
        self, models: tuple[NodeModel, ...]
    ) -> Generator[Step, None, tuple[MaterialVariation, ...]]:
        """What varies over each material, by photos that are held out."""
        mesh = self.fitted.scan.mesh
        grid = SurfaceGrid.with_nodes(mesh, CHOICE_NODES)
        seen = yield from self._observed(grid, 0.0, READ)
        material = self._materials(grid)
        kinds = []
        share = (CHOSEN - READ) / len(models)
        for index, model in enumerate(models):
            rows = np.flatnonzero(material == index)
            own = _of_material(seen, rows, index, len(grid))
            if not len(own):
                kinds.append(MaterialVariation("even", {}))
                continue
            nodes = Nodes(grid.points(rows), grid.normals(rows).astype(np.float32), grid.spacing)
            at = READ + index * share
            kinds.append(
                (
                    yield from relayed(
                        steps_in_background(choose(model, own, nodes)),
                        lambda done, at=at: Step(  # type: ignore[misc]
                            "predicting held-out photos", at + share * done
                        ),
                    )
                )
            )
        return tuple(kinds)

    def _observed(
        self, grid: SurfaceGrid, start: float, share: float
    ) -> Generator[Step, None, Observations]:
        """The observations of all nodes in all photos."""
        fitted, count = self.fitted, len(self.fitted.capture.photos)
        parts = []
        for place in range(count):
            step = Step("reading the surface in the photos", start + share * place / count)
            parts.append((yield from in_background(lambda p=place: _one(fitted, grid, p), step)))  # type: ignore[misc]
        return Observations.joined(parts)

    def _materials(self, grid: SurfaceGrid) -> NDArray[np.integer]:
        """(n,) material of each node; −1 for vertices without a face."""
        face = grid.places[0]
        return np.where(face >= 0, self.fitted.face_material[face], -1)


def _one(fitted: CaptureResult, grid: SurfaceGrid, place: int) -> Observations:
    """The observations of one photo."""
    capture, scan = fitted.capture, fitted.scan
    camera = capture_data.camera_of(capture, scan, place)
    photo, light = fitted.photos.read(place), fitted.lights.of(capture, place)
    labels = label_pixels(capture, scan, fitted.rays, camera, place, photo, light)
    surface = SurfacePhoto(fitted.rays, camera, light, photo.radiance, labels)
    return observe(surface, place, grid)


def _model(fitted: CaptureResult, index: int) -> NodeModel:
    material = fitted.materials[index]
    off = material.fit.normal_deviation if isinstance(material.fit, MeasuredResult) else 0.0
    return NodeModel.of(MaterialLevel.of(material.name, material.fit.brdf, material.scale, off))


def _of_material(
    seen: Observations, rows: NDArray[np.intp], index: int, count: int
) -> Observations:
    """The observations of one material at its own nodes ``rows``, numbered from 0."""
    number = np.full(count, -1, np.int32)
    number[rows] = np.arange(len(rows), dtype=np.int32)
    own = seen.select(np.flatnonzero((seen.material == index) & (number[seen.node] >= 0)))
    return replace(own, node=number[own.node])


def _sentence(name: str, kind: MaterialVariation) -> str:
    """What was found about a material, for the user."""
    if kind.kind != "even":
        return f"{name} varies over the surface: {kind.kind}."
    if not kind.cost:
        return f"{name} is taken as even: too few photos show it."
    return f"{name} is even: photos that were held out are not predicted better with variation."
