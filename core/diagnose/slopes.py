"""How a prediction changes with every unknown: coefficients, and the numbers of effects.

A number may be felt by a part of the pixels only (those of a photo, of a patch of the surface).
Numbers that no pixel feels together share a slot: they are moved at once for the difference
quotient, and a row of the matrix holds a slot's entry once, in the column of its pixel's number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from .fitted import Fitted
from .model import Lit, Model

Array = NDArray[np.floating]

FEW = 3  # parts of a lamp whose rows stand for all
RISE = 1e-3  # relative, for the slope of what the camera does


@dataclass(frozen=True)
class Slopes:
    """Of n pixels, in units of their deviation. rho: (n, 3) ∂ prediction/∂ ln(ρ·cosMap + ε), by
    which q, (n, k), is multiplied; x: (n, 3, s) ∂ prediction/∂ number, of the number in column
    (n, s) of all count. local: (n, 3, e) ∂ prediction/∂ the numbers of a pixel's patch, (n,) −1
    none, of so many patches."""

    rho: Array
    q: Array
    x: Array
    column: NDArray[np.int32]
    count: int
    local: Array
    patch: NDArray[np.intp]
    patches: int

    def matrix(self, rows: NDArray[np.intp], channel: int) -> csr_array:
        """(r, count) by the numbers, of some pixels."""
        slots = self.column.shape[1]
        starts = np.arange(len(rows) + 1) * slots
        values = self.x[rows, channel].ravel()
        return csr_array((values, self.column[rows].ravel(), starts), shape=(len(rows), self.count))

    def local_matrix(self, rows: NDArray[np.intp], channel: int) -> csr_array:
        """(r, patches · e) by the numbers of patches, of some pixels."""
        e = self.local.shape[2]
        column = np.maximum(self.patch[rows, None], 0) * e + np.arange(e)
        return csr_array(
            (self.local[rows, channel].ravel(), column.ravel(), np.arange(len(rows) + 1) * e),
            shape=(len(rows), self.patches * e),
        )


def slopes_of(fitted: Fitted) -> Slopes:
    """At the model's present numbers."""
    model, deviation = fitted.model, fitted.deviation
    lit = model.lit
    now, q = lit.now, _rows(model, lit)
    entering = model.entering(lit.reflected, now)
    recorded = model.recorded(entering, now)
    grown = (1 + RISE) * entering
    camera = (model.recorded(grown, now) - recorded) / np.where(entering > 0, RISE * entering, 1)
    camera = np.where(entering > 0, camera, 1.0)
    per_log = (lit.slope * camera / deviation).astype(np.float32)

    def by_slot(place: int) -> list[Array]:
        effect = model.effects[place]
        found = []
        for slot in model.feels(place).T:
            step = effect.numbers.step[slot[slot >= 0][0]] if (slot >= 0).any() else 1.0
            moved = _moved(model, place, np.unique(slot[slot >= 0]), step)
            slope = (moved - recorded) / (step * deviation)
            found.append(np.where(slot[:, None] >= 0, slope, 0).astype(np.float32))
        return found

    n, first = len(model.pixels), 0
    x, column = [np.zeros((n, 3, 0), np.float32)], [np.zeros((n, 0), np.int32)]
    for place in model.everywhere:
        x += [slope[..., None] for slope in by_slot(place)]
        column.append(first + np.maximum(model.feels(place), 0).astype(np.int32))
        first += len(model.effects[place].numbers)
    local, patch, patches = np.zeros((n, 3, 0), np.float32), np.full(n, -1), 0
    if model.patchy is not None:
        local = np.stack(by_slot(model.patchy), axis=2)
        found = model.effects[model.patchy].patch
        assert found is not None
        patch, patches = found, int(found.max()) + 1
    joined, columns = np.concatenate(x, axis=2), np.concatenate(column, axis=1)
    return Slopes(per_log, q, joined, columns, first, local, patch, patches)


def _rows(model: Model, lit: Lit) -> Array:
    """Q̂ (n, k): means over a few parts of the lamp, as much as each shows."""
    parts, brdfs = model.lamps(lit.now), model.brdfs
    if len(parts) == 1:
        return model.rows(lit.now)
    q = shares = np.zeros((), np.float32)
    for part in parts[:: max(1, len(parts) // FEW)]:
        share = brdfs.slope(part).mean(axis=1, dtype=np.float32)[:, None] + np.float32(1e-12)
        shares, q = shares + share, q + share * model.rows(part)
    return np.asarray(q / shares)


def _moved(model: Model, place: int, numbers: NDArray[np.intp], step: float) -> Array:
    """The prediction with some numbers of an effect a step on."""
    x = list(model.x)
    x[place] = x[place].copy()
    x[place][numbers] += step
    if model.effects[place].lights:
        return model.predicted(x)
    return model.shown(model.lit.now, model.lit.reflected, x)
