"""Fit a capture, and estimate how its materials vary over the surface."""

from __future__ import annotations

from collections.abc import Iterator

from ...concurrency.job import Job, Step, finished
from ...varying.labels import check_material_count
from ..fit_job import CaptureResult, FitJob
from .node_steps import CHOICE_NODES
from .separate_materials import separate_materials
from .surface_observations import observe_surface
from .variation_estimator import MAX_NODES, VariationEstimator

FITTED, OBSERVED, SEPARATED, VARIED = 0.25, 0.3, 0.45, 0.95
"""Fractions of the time after which the fit is done, photos are read, materials are separated, and
the variation is estimated."""


class VaryingJob(Job):
    """Sets ``result``: the fit of ``fit`` with the variation of its materials, and with their BRDFs
    fitted again without it. It is the fit as it was where held-out photos find all materials even.
    A single material is separated into several where these predict held-out photos better.

    fit: that has not run, or that has finished. mode: "auto", or "always" for all that can vary.
    nodes: of the grid on the mesh.
    """

    def __init__(self, fit: FitJob, mode: str = "auto", nodes: int = MAX_NODES) -> None:
        super().__init__()
        self.portable, fit.portable = fit.portable, False  # of the final materials only
        self.fit, self.mode, self.nodes = fit, mode, nodes
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        """Fit, separate materials and choose what varies on a coarse grid, then estimate it on a
        fine one."""
        check_material_count(self.fit.capture)
        if self.fit.result is None:
            for step in self.fit.run():
                yield Step(step.stage, FITTED * step.fraction)
        before = finished(self.fit.result)
        coarse = yield from observe_surface(
            before, CHOICE_NODES, FITTED, OBSERVED - FITTED, threads=self.fit.threads
        )
        parts = yield from separate_materials(
            self.fit, coarse, CHOICE_NODES, OBSERVED, SEPARATED - OBSERVED
        )
        if parts is not None:
            self.fit, coarse = parts.fit, parts.surface
        before = finished(self.fit.result)
        own = VariationEstimator(
            self.fit, before, self.mode, self.nodes, parts=parts, portable=self.portable
        )
        self.result = yield from own.varied(coarse, SEPARATED, VARIED - SEPARATED)
