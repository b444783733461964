"""A material whose highlights are blurred, sharpened as far as unseen photos bear it out."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial

import numpy as np

from ..diagnose.corrected import Corrected
from ..fit.held_out import HeldOut, Judge
from ..samples import SampleTable
from .fit_job import MaterialResult
from .job import Step

PASSES = 4  # at most
GAIN = 0.05  # ln of the error of unseen photos: a pass that gains less sharpens what nobody saw

Fit = Generator[Step, None, MaterialResult]
Again = Callable[[SampleTable, Judge | None, float, float], Fit]
"""(samples, how photos that are held out are predicted, where it starts, its share of the job)."""


def fitted_sharply(
    of: Corrected, again: Again, start: float, share: float, exactly: bool = False
) -> Generator[Step, None, tuple[MaterialResult, bool]]:
    """(the material, whether its highlights are sharper than the samples'); of photos none of which
    can be held out one pass is taken. exactly: one is, whatever unseen photos say of it."""
    passes = 0 if of.blur is None else PASSES
    share /= 1 + passes
    found = yield from again(of.table, None, start, share)
    if of.blur is None:
        return found, False
    judge, sharp = partial(of.blur.left_out, of.table), False
    for done in range(passes):
        table = of.blur.sharpened(of.table, found.fit.brdf)
        other = yield from again(table, judge, start + (1 + done) * share, share)
        gained = _gained(found.held_out, other.held_out)
        if gained is not None and gained < GAIN and not (exactly and done == 0):
            break
        found, sharp = other, True
        if gained is None:
            break
    return found, sharp


def _gained(before: HeldOut | None, after: HeldOut | None) -> float | None:
    """Mean over the photos that both have of ln of their errors; None where there are none."""
    if before is None or after is None:
        return None
    both = sorted(before.per_photo.keys() & after.per_photo.keys())
    if not both:
        return None
    errors = [[max(one.per_photo[p], 1e-9) for p in both] for one in (before, after)]
    return float(np.mean(np.log(errors[0])) - np.mean(np.log(errors[1])))
