"""The misfit between predicted and measured radiance of one lamp's pixels.

The residual is a difference of logarithms, log(P + s) − log(L + s), so that highlights do not
outweigh shading, and its absolute value is capped, so that stains and misplaced outlines have a
bounded influence. s is a fraction of the level of the lit pixels: below it, dark is dark.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

LEVEL_SHARE = 0.3  # of the light is in pixels darker than the level: the level of lit surface, also
# where most of the photo is in shadow or a highlight holds most of the light
OFFSET = 0.6  # s in units of the level
DARK = 0.25  # of s: a darker pixel says nothing about the albedo
MAX_RESIDUAL = 1.0  # |log residual| from which a pixel counts no more
MIN_RESIDUAL = 0.05  # |log residual| below which all pixels have the same weight
GAIN_ROUNDS = 3  # of reweighted least squares


@dataclass(frozen=True)
class Measured:
    """Measured radiance of n pixels of one lamp. radiance: (n,); offset: s, the same unit."""

    radiance: NDArray[np.float64]
    offset: float

    @classmethod
    def of(cls, radiance: NDArray[np.float64]) -> Measured:
        """With the offset from the pixels' own level."""
        ordered = np.sort(radiance)
        light = np.cumsum(ordered)
        if not len(ordered) or not light[-1] > 0:
            return cls(radiance, 1.0)
        level = ordered[min(np.searchsorted(light, LEVEL_SHARE * light[-1]), len(ordered) - 1)]
        return cls(radiance, OFFSET * float(level))

    @property
    def weight(self) -> NDArray[np.float64]:
        """(n,) 1 / standard deviation of least squares, for errors proportional to radiance."""
        return np.asarray(1.0 / (self.radiance + self.offset))

    def residual(self, predicted: Array) -> NDArray[np.float64]:
        """(n,) log(P + s) − log(L + s)."""
        s = self.offset
        return np.asarray(np.log((predicted + s) / (self.radiance + s)), np.float64)

    def log_ratio(self, predicted: Array) -> NDArray[np.float64]:
        """(n,) log(L / P), NaN where either is dark."""
        known = (predicted > self.offset * DARK) & (self.radiance > self.offset * DARK)
        safe = np.where(known, self.radiance, 1.0) / np.where(known, predicted, 1.0)
        return np.where(known, np.log(safe), np.nan)

    def cost(self, predicted: Array) -> float:
        """Mean capped |residual|."""
        return float(np.mean(np.minimum(np.abs(self.residual(predicted)), MAX_RESIDUAL)))

    def robust_weight(self, predicted: Array) -> NDArray[np.float64]:
        """(n,) 1 / |residual|, which makes least squares minimise absolute residuals."""
        return 1.0 / np.maximum(np.abs(self.residual(predicted)), MIN_RESIDUAL)

    def gain(self, predicted: Array) -> float:
        """The factor of ``predicted`` with the smallest absolute residuals: the irradiance of the
        lamp relative to that of the prediction."""
        w = np.square(self.weight)
        found = _ratio(w, predicted, self.radiance)
        for _ in range(GAIN_ROUNDS):
            found = _ratio(w * self.robust_weight(found * predicted), predicted, self.radiance)
        return found


def _ratio(weight: Array, predicted: Array, radiance: Array) -> float:
    return float(
        np.sum(weight * predicted * radiance) / max(np.sum(weight * predicted * predicted), 1e-300)
    )
