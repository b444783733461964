"""A second fit of materials that vary over the surface."""

from __future__ import annotations

from collections.abc import Iterator

from ..concurrency.job import Job, Step, finished
from ..varying.corrected_observations import ObservationCorrection
from ..varying.labels import check_material_count
from .check_job import CheckJob
from .diagnose_job import DiagnoseJob
from .fit_job import CaptureResult
from .refit_job import RefitJob
from .varying.node_steps import CHOICE_NODES
from .varying.surface_observations import observe_surface
from .varying.variation_estimator import MAX_NODES, VariationEstimator

SECOND_FIT, OBSERVED, VARIED = 0.6, 0.63, 0.97
"""Fractions of the time after which the second fit is done, photos are read, and the variation is
estimated."""


class VaryingSecondFit(Job):
    """Sets ``result``: that of a second fit, with the variation of its materials, estimated from
    observations that are corrected for the causes that the fit takes into account.

    second: that has not run; of a CheckJob, a single material may be separated into several first.
    mode, nodes: as of VaryingJob.
    """

    def __init__(
        self, second: CheckJob | RefitJob, mode: str = "auto", nodes: int = MAX_NODES
    ) -> None:
        super().__init__()
        self.portable, second.portable = second.portable, False  # of the final materials only
        if isinstance(second, CheckJob):
            second.checked.separate = True
        self.second, self.mode, self.nodes = second, mode, nodes
        self.result: CaptureResult | None = None

    @property
    def checked(self) -> DiagnoseJob:
        """The diagnosis."""
        return self.second.checked

    def run(self) -> Iterator[Step]:
        """The second fit, what varies on a coarse grid, and the variation on a fine one."""
        check_material_count(self.checked.fit.capture)
        for step in self.second.run():
            yield Step(step.stage, SECOND_FIT * step.fraction)
        before, correction = finished(self.second.result), self._correction()
        fit, parts = self.checked.fit, self.checked.parts
        coarse = self.checked.surface
        if coarse is None or correction is not None:
            coarse = yield from observe_surface(
                before,
                CHOICE_NODES,
                SECOND_FIT,
                OBSERVED - SECOND_FIT,
                correction,
                fit.threads,
                whole=None if parts is None else parts.whole,
            )
        own = VariationEstimator(
            fit, before, self.mode, self.nodes, correction, parts, self.portable
        )
        self.result = yield from own.varied(coarse, OBSERVED, VARIED - OBSERVED)

    def _correction(self) -> ObservationCorrection | None:
        """For the causes that the second fit takes into account; None where there are none."""
        result, joint = finished(self.second.result), self.second.fitted
        causes = {effect.cause for effect in result.effects}
        if joint is None or not causes:
            return None
        context = finished(self.checked.context)
        return ObservationCorrection.of(
            joint.model, causes, context, result.capture, result.scan, result.photos
        )
