"""Residuals averaged in the coordinates of the camera's sensor, over all photos.

What stays at one place of the sensor while the object and the lamp move belongs to the camera: dark
corners, dust, glare of the lens.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..selection.weighted_means import weighted_means
from ..solver.model_fit import ModelFit

Grid = NDArray[np.float64]

ACROSS, DOWN = 24, 16  # cells of the sensor
MIN_PIXELS = 20  # in a cell


@dataclass(frozen=True)
class SensorResiduals:
    """mean: (DOWN, ACROSS) photo minus prediction relative to the prediction, weighted by the
    inverse variance of pixels. error: (DOWN, ACROSS) standard errors, with held-out regions as
    independent units. Both NaN in cells with few pixels. width, height: half sizes of the grid, 1
    half the photo's diagonal."""

    mean: Grid
    error: Grid
    width: float
    height: float

    @property
    def significant(self) -> float:
        """Fraction of the cells that are off by more than two standard errors; 0.05 by chance."""
        known = np.isfinite(self.mean)
        beyond = np.abs(self.mean[known]) > 2 * self.error[known]
        return float(np.mean(beyond)) if known.any() else 0.0

    @classmethod
    def of(cls, fit: ModelFit) -> SensorResiduals:
        """fit: at its optimum."""
        pixels, shown = fit.model.pixels, np.asarray(fit.predicted, np.float64)
        good = np.isfinite(fit.deviation).all(axis=1) & (shown.mean(axis=1) > 0)
        width, height = (max(float(np.abs(v).max(initial=0.0)), 1e-9) for v in (pixels.x, pixels.y))
        cell = _cells(pixels.x / width, ACROSS) + ACROSS * _cells(pixels.y / height, DOWN)
        each = fit.residual[good], shown[good], fit.deviation[good], pixels.block[good]
        found = weighted_means(cell[good], ACROSS * DOWN, MIN_PIXELS, *each)
        shape = DOWN, ACROSS
        return cls(found.mean.reshape(shape), found.error.reshape(shape), width, height)


def _cells(at: NDArray[np.floating], count: int) -> NDArray[np.intp]:
    """(n,) cell of a coordinate −1 .. 1."""
    return np.clip(((at + 1) / 2 * count).astype(np.intp), 0, count - 1)
