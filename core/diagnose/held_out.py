"""What a model predicts of parts of the photos that it was not fitted to.

Every photo is cut into squares; a part of them at a time is left out, the optimum moves as the
normal equations say (a Newton step, which is exact for a linear model), and the left-out pixels are
predicted. What neighbouring pixels err by is alike, so it is squares that count as independent, not
pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .equations import Equations
from .fitted import Fitted, robust
from .slopes import Slopes, slopes_of

Array = NDArray[np.floating]

FOLDS = 5


@dataclass(frozen=True)
class Unseen:
    """residual: (n, 3) of every pixel, predicted without its square's fold, in units of its
    deviation. cost: (n,) nats. covariance: (p, p) of the effects' numbers."""

    residual: Array
    cost: Array
    covariance: Array

    @property
    def mean(self) -> float:
        """Cost of a pixel and channel, nats."""
        return float(self.cost.mean()) / self.residual.shape[1]


def folds(fitted: Fitted) -> NDArray[np.int32]:
    """(n,) fold of every pixel: squares in turn, so that every photo is in every fold."""
    _, place = np.unique(fitted.model.pixels.block, return_inverse=True)
    shuffled = np.random.default_rng(0).permutation(int(place.max()) + 1 if len(place) else 0)
    return (shuffled[place.ravel()] % FOLDS).astype(np.int32)


def predict_unseen(fitted: Fitted) -> Unseen:
    """At an optimum."""
    slopes = slopes_of(fitted)
    of = folds(fitted)
    rows = [np.flatnonzero(of == f) for f in range(FOLDS)]
    parts = [Equations.of(fitted, slopes, r) for r in rows]
    whole = parts[0]
    for part in parts[1:]:
        whole = whole.plus(part)
    residual = np.array(fitted.residual, np.float64)
    for part, mine in zip(parts, rows, strict=True):
        change, x, _ = whole.plus(part, -1.0).solved(fitted)
        residual[mine] -= _change(fitted, slopes, mine, change, x)
    covariance = whole.solved(fitted)[2]
    return Unseen(residual, robust(residual).sum(axis=1), covariance)


def _change(
    fitted: Fitted, slopes: Slopes, rows: NDArray[np.intp], change: Array, x: Array
) -> Array:
    """(r, 3) what the prediction changes by, in units of the deviation."""
    material = fitted.model.pixels.material[rows]
    out = np.stack([slopes.matrix(rows, c) @ x for c in range(3)], axis=1)
    for index in range(len(change)):
        mine = np.flatnonzero(material == index)
        out[mine] += slopes.rho[rows[mine]] * (slopes.q[rows[mine]] @ change[index].T)
    return np.asarray(out)
