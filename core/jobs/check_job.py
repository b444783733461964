"""Fit, diagnose, and fit again with a correction for the causes that were found."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from ..concurrency.background import in_background
from ..concurrency.job import Job, Step, finished
from ..diagnose.assessment.assessment import Assessment
from ..diagnose.pixels.pixel_selection import COUNT
from ..diagnose.selection.effect_subset import with_contradicted
from ..diagnose.solver.model_fit import ModelFit
from .diagnose_job import EXAMINING, DiagnoseJob
from .fit_job import CaptureResult, FitJob
from .refit_job import RefitJob

SHARE = 0.84  # fraction of the job's time before the second fit


class CheckJob(Job):
    """Sets ``checked``, the diagnosis with the first fit, and ``result``, the second fit with a
    correction for the named causes except ``without``. Both are complete when the job is done.
    The diagnosis then has an assessment too.
    ``fitted``: the joint fit that the second one is based on, None if it corrects nothing.
    Causes that the second fit does not confirm are no longer named (Diagnosis.contradicted). The
    materials of ``result`` have portable forms if those of ``fit`` would have had them. pixels: as
    in DiagnoseJob."""

    def __init__(self, fit: FitJob, without: Collection[str] = (), pixels: int = COUNT) -> None:
        super().__init__()
        self.portable, fit.portable = fit.portable, False  # of the second fit's materials only
        self.checked = DiagnoseJob(fit, pixels=pixels)
        self.without = frozenset(without)
        self.result: CaptureResult | None = None
        self.fitted: ModelFit | None = None

    def run(self) -> Iterator[Step]:
        """The steps of the diagnosis, then those of the second fit."""
        for step in self.checked.run():
            yield Step(step.stage, SHARE * step.fraction)
        again = RefitJob(self.checked, without=self.without, portable=self.portable)
        step = Step(EXAMINING, SHARE)
        for inner in again.run():
            step = Step(inner.stage, SHARE + (1 - SHARE) * inner.fraction)
            yield step
        found = finished(self.checked.found)
        self.checked.found = yield from in_background(
            lambda: with_contradicted(found, again.contradicted, again.fitted), step
        )
        last = self.checked.found
        self.checked.assessment = yield from in_background(
            lambda: Assessment.of(last.after, last.held_out_after), step
        )
        self.result, self.fitted = again.result, again.fitted
