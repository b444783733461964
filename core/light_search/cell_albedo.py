"""Albedo that varies over the surface, from residuals that different lamps have in common.

A wrong light leaves residuals that differ from lamp to lamp; where the surface is darker than the
rest, all lamps' residuals are negative. The variance of the albedo is therefore the covariance of
residuals of the same cell under different lamps, and each cell's albedo is the mean residual,
shrunk by the share of that variance (empirical Bayes, Efron & Morris 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CELLS = 40  # along the longest axis of the surface
MAX_LOG_RATIO = 1.5  # of a pixel
MIN_SHARED_CELLS = 50  # seen lit by two lamps: with fewer there is no estimate
MIN_SPREAD = 0.05  # standard deviation of the log albedo: below it the albedo counts as even


@dataclass(frozen=True)
class CellGrid:
    """Cubic cells of space. low: (3,); edge: scan units."""

    low: Array
    edge: float

    @classmethod
    def around(cls, points: Array) -> CellGrid:
        """CELLS of them along the longest axis of points (n, 3)."""
        low, high = np.percentile(points, [0.5, 99.5], axis=0)
        return cls(low, max(float((high - low).max()) / CELLS, 1e-30))

    def keys(self, points: Array) -> NDArray[np.int64]:
        """(n,) number of each point's cell."""
        cell = np.clip(np.floor((points - self.low) / self.edge), -1, CELLS).astype(np.int64) + 1
        return np.asarray((cell[:, 0] * (CELLS + 2) + cell[:, 1]) * (CELLS + 2) + cell[:, 2])


@dataclass(frozen=True)
class CellAlbedo:
    """keys: (c,) sorted numbers of cells; log_albedo: (c,) relative to the mean."""

    grid: CellGrid
    keys: NDArray[np.int64]
    log_albedo: Array

    def at(self, points: Array) -> Array:
        """(n,) relative albedo; 1 in cells without an estimate."""
        wanted = self.grid.keys(points)
        place = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        return np.where(self.keys[place] == wanted, np.exp(self.log_albedo[place]), 1.0)


def shared_albedo(
    grid: CellGrid, points: Sequence[Array], log_ratios: Sequence[Array]
) -> CellAlbedo | None:
    """The albedo of the surface's cells. None where it is even, or too few cells are lit by two
    lamps.

    points: for each lamp (n, 3); log_ratios: for each lamp (n,) log of measured by predicted
    radiance, NaN for pixels that it does not light.
    """
    keys, lamps, ratios = [], [], []
    for lamp, (where, ratio) in enumerate(zip(points, log_ratios, strict=True)):
        known = np.isfinite(ratio)
        if not known.any():
            continue
        centred = ratio[known] - np.median(ratio[known])
        keys.append(grid.keys(where[known]))
        lamps.append(np.full(int(known.sum()), lamp))
        ratios.append(np.clip(centred, -MAX_LOG_RATIO, MAX_LOG_RATIO))
    if not keys:
        return None
    cells, cell = np.unique(np.concatenate(keys), return_inverse=True)
    pair = cell.ravel() * len(points) + np.concatenate(lamps)
    pairs, index = np.unique(pair, return_inverse=True)
    mean = np.bincount(index.ravel(), np.concatenate(ratios)) / np.bincount(index.ravel())
    of_cell = pairs // len(points)
    several = np.bincount(of_cell, minlength=len(cells))
    total = np.bincount(of_cell, mean, len(cells))
    squares = np.bincount(of_cell, mean * mean, len(cells))
    shared = several > 1
    if shared.sum() < MIN_SHARED_CELLS:
        return None
    products = (total**2 - squares)[shared].sum()
    variance = products / (several * (several - 1))[shared].sum()
    if not variance > MIN_SPREAD**2:
        return None
    rest = max(float(np.mean(mean * mean)) - variance, 1e-9)
    return CellAlbedo(grid, cells, total * variance / (several * variance + rest))
