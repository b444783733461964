"""Fit coefficients and effects together: Gauss–Newton with robust weights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .equations import Change, Equations
from .fitted import Fitted
from .model import Model
from .slopes import slopes_of

Array = NDArray[np.floating]

STEPS, HALVINGS = 25, 5
SETTLED = 1e-4  # of the cost


def fit(model: Model, deviation: Array, steps: int = STEPS) -> Fitted:
    """From the model as it is; deviation: (n, 3) radiance, inf where a pixel does not count."""
    now = Fitted.of(model, deviation)
    for _ in range(steps):
        found = _stepped(now)
        gained = now.whole - found.whole
        now = found if gained > 0 else now
        if gained < SETTLED * max(now.cost, 1.0):
            break
    return now


def _stepped(now: Fitted) -> Fitted:
    """A Gauss–Newton step, shortened until it helps; numbers stay within their bounds."""
    everything = np.arange(len(now.residual))
    change = Equations.of(now, slopes_of(now), everything).solved(now)
    share = 1.0
    best = now
    for _ in range(HALVINGS):
        best = Fitted.of(_with(now.model, change, share), now.deviation)
        if best.whole < now.whole:
            break
        share /= 2
    return best


def _with(model: Model, change: Change, share: float) -> Model:
    coefficients = model.brdfs.coefficients + share * change.coefficients
    brdfs = replace(model.brdfs, coefficients=coefficients)
    parts, at = [], 0
    for place, (effect, old) in enumerate(zip(model.effects, model.x, strict=True)):
        numbers = effect.numbers
        step = change.local if place == model.patchy else change.x[at : at + len(numbers)]
        parts.append(np.clip(old + share * step, numbers.low, numbers.high))
        at += 0 if place == model.patchy else len(numbers)
    return replace(model, brdfs=brdfs, x=tuple(parts))
