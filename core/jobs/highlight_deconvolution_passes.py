"""A material whose highlights are blurred, sharpened as far as unseen photos bear it out."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial

from ..concurrency.background import in_background
from ..concurrency.job import Step
from ..diagnose.correction.sample_correction import CorrectedSamples
from ..fit.held_out import HeldOut, Judge
from ..samples import SampleTable
from .acceptance import by_photo, grown
from .fit_job import MaterialResult

STAGE = "sharpening highlights"
PASSES = 4  # at most
GAIN = 0.05  # ln of the error of unseen photos: a pass that gains less sharpens what nobody saw

Fit = Generator[Step, None, MaterialResult]
FitAgain = Callable[[SampleTable, Judge | None, float, float], Fit]
"""(samples, how photos that are held out are predicted, where it starts, its share of the job)."""


def fitted_sharply(
    of: CorrectedSamples, again: FitAgain, start: float, share: float, exactly: bool = False
) -> Generator[Step, None, tuple[MaterialResult, bool]]:
    """(the material, whether its highlights are sharper than the samples'); of photos none of which
    can be held out one pass is taken. exactly: one is, whatever unseen photos say of it."""
    blur = of.blur
    if blur is None:
        return (yield from again(of.table, None, start, share)), False
    share /= 1 + PASSES
    found = yield from again(of.table, None, start, share)
    judge, sharp = partial(blur.left_out, of.table), False
    for done in range(PASSES):
        at = start + (1 + done) * share
        sharpened = partial(blur.sharpened, of.table, found.fit.brdf)
        table = yield from in_background(sharpened, Step(STAGE, at))
        other = yield from again(table, judge, at, share)
        gained = _gained(found.held_out, other.held_out)
        if gained is not None and gained < GAIN and not (exactly and done == 0):
            break
        found, sharp = other, True
        if gained is None:
            break
    return found, sharp


def _gained(before: HeldOut | None, after: HeldOut | None) -> float | None:
    """ln of what a usual photo's error fell by; None where no photo has both."""
    errors = None if before is None or after is None else by_photo(before, after)
    return None if errors is None else -grown(*errors)
