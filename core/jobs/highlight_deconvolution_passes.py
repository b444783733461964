"""Deconvolution of blurred highlights, pass by pass, while held-out photos are predicted better."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial

from ..concurrency.background import in_background
from ..concurrency.job import Step
from ..diagnose.correction.sample_correction import CorrectedSamples
from ..fit.held_out import HeldOutErrors, Judge
from ..samples import SampleTable
from .acceptance import log_growth, mean_photo_errors
from .fit_job import MaterialResult

STAGE = "sharpening highlights"
MAX_PASSES = 4  # at most
MIN_LOG_GAIN = 0.05  # ln of the factor by which a pass has to reduce the error of held-out photos

Fit = Generator[Step, None, MaterialResult]
FitAgain = Callable[[SampleTable, Judge | None, float, float], Fit]
"""(samples, how held-out photos are predicted, start, share) → fit; start and share are fractions
of the job."""


def fit_with_deconvolution(
    of: CorrectedSamples, again: FitAgain, start: float, share: float, exactly: bool = False
) -> Generator[Step, None, tuple[MaterialResult, bool]]:
    """(the material, whether its highlights are sharper than in the samples). If no photo can be
    held out, one pass is made. exactly: the first pass is accepted even if it does not improve the
    prediction of held-out photos."""
    blur = of.blur
    if blur is None:
        return (yield from again(of.table, None, start, share)), False
    share /= 1 + MAX_PASSES
    found = yield from again(of.table, None, start, share)
    judge, sharp = partial(blur.predict_held_out, of.table), False
    for done in range(MAX_PASSES):
        at = start + (1 + done) * share
        sharpened = partial(blur.sharpened, of.table, found.fit.brdf)
        table = yield from in_background(sharpened, Step(STAGE, at))
        other = yield from again(table, judge, at, share)
        gained = _log_gain(found.held_out, other.held_out)
        if gained is not None and gained < MIN_LOG_GAIN and not (exactly and done == 0):
            break
        found, sharp = other, True
        if gained is None:
            break
    return found, sharp


def _log_gain(before: HeldOutErrors | None, after: HeldOutErrors | None) -> float | None:
    """ln of the factor by which the error of held-out photos fell, geometric mean over photos; None
    where no photo has both errors."""
    errors = None if before is None or after is None else mean_photo_errors(before, after)
    return None if errors is None else -log_growth(*errors)
