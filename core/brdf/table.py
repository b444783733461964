"""A BRDF tabulated on the MERL grid, at the centre of every cell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, merl_grid


@dataclass(frozen=True)
class TabulatedBRDF:
    """Reflectance ρ at the centres of the MERL cells.

    values: (3, 90, 90, 180) float32, 1/sr, channels R, G, B; invalid cells are negative.
    """

    values: NDArray[np.float32]

    @classmethod
    def from_function(cls, evaluate: Callable[[Angles], NDArray[np.floating]]) -> TabulatedBRDF:
        """Table of ``evaluate(angles) -> (n, 3)``; -1 where light or view is below the horizon."""
        centres = merl_grid.node_angles(0.5)
        seen = merl_grid.visible(centres)
        values = np.full((3, *merl_grid.SHAPE), -1.0, np.float32)
        where = np.flatnonzero(seen)
        flat = [a.ravel() for a in centres]
        out = values.reshape(3, -1)
        for start in range(0, where.size, 1 << 18):  # in blocks, to limit memory
            part = where[start : start + (1 << 18)]
            out[:, part] = evaluate(Angles(*(a[part] for a in flat))).T
        return cls(values)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """(90, 90, 180): cells with a measurement in all channels."""
        return np.all(self.values >= 0, axis=0)

    def nearest(self, angles: Angles) -> NDArray[np.float32]:
        """(..., 3): value of the cell that contains each direction, negative where invalid."""
        return np.moveaxis(self.values[(slice(None), *merl_grid.index(angles))], 0, -1)

    def evaluate(self, angles: Angles) -> NDArray[np.float32]:
        """(..., 3): trilinear between cell centres (in the square root of θh; φd periodic).

        Invalid cells are skipped (the weights are renormalised); -1 where all eight are invalid.
        """
        u_h = 90.0 * np.sqrt(np.clip(angles.theta_h / merl_grid.HALF_PI, 0, 1)) - 0.5
        u_d = np.degrees(angles.theta_d) - 0.5
        u_p = np.degrees(angles.phi_d) - 0.5
        total = np.zeros((*np.shape(u_h), 3), np.float32)
        weight = np.zeros(np.shape(u_h), np.float32)
        for corner_h, w_h in _two(np.clip(u_h, 0, 89), 90):
            for corner_d, w_d in _two(np.clip(u_d, 0, 89), 90):
                for corner_p, w_p in _two(np.mod(u_p, 180.0), 180, periodic=True):
                    value = self.values[:, corner_h, corner_d, corner_p]
                    w = w_h * w_d * w_p * np.all(value >= 0, axis=0)
                    total += np.moveaxis(value * w, 0, -1)
                    weight += w.astype(np.float32)
        good = weight > 1e-6
        return np.where(good[..., None], total / np.maximum(weight, 1e-6)[..., None], -1.0)


def _two(u: NDArray[np.floating], size: int, periodic: bool = False):  # type: ignore[no-untyped-def]
    """The two neighbours of a fractional index and their weights."""
    low = np.floor(u).astype(np.intp)
    high_weight = (u - low).astype(np.float32)
    if periodic:
        return ((low % size, 1 - high_weight), ((low + 1) % size, high_weight))
    low = np.minimum(low, size - 1)
    return ((low, 1 - high_weight), (np.minimum(low + 1, size - 1), high_weight))
