"""Fit, diagnose, and fit again with what was found."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from ..concurrency.background import in_background
from ..concurrency.job import Job, Step, finished
from ..diagnose.selection.effect_subset import with_contradicted
from .diagnose_job import LOOKING, DiagnoseJob
from .fit_job import CaptureResult, FitJob
from .refit_job import RefitJob

SHARE = 0.85  # of the job, before the second fit


class CheckJob(Job):
    """``checked`` is the diagnosis with the fit as it was, ``result`` the fit with what was named
    in the model, but without the causes ``without``; they are there when the job is done. What the
    second fit does not bear out is named no more (Found.contradicted). Its
    materials have portable forms where those of ``fit`` would have."""

    def __init__(self, fit: FitJob, without: Collection[str] = ()) -> None:
        super().__init__()
        self.portable, fit.portable = fit.portable, False  # of the second fit's materials only
        self.checked = DiagnoseJob(fit)
        self.without = frozenset(without)
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        """The diagnosis' steps, then those of the second fit."""
        for step in self.checked.run():
            yield Step(step.stage, SHARE * step.fraction)
        again = RefitJob(self.checked, without=self.without, portable=self.portable)
        step = Step(LOOKING, SHARE)
        for inner in again.run():
            step = Step(inner.stage, SHARE + (1 - SHARE) * inner.fraction)
            yield step
        found = finished(self.checked.found)
        self.checked.found = yield from in_background(
            lambda: with_contradicted(found, again.contradicted, again.fitted), step
        )
        self.result = again.result
