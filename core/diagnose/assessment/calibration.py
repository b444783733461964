"""Whether the errors that the model states are those that it makes: the probability integral
transform of held-out pixels (Dawid 1984; Gneiting, Balabdaoui and Raftery 2007).

Each held-out value is turned into the probability that the prediction gave to a smaller one. If the
stated distribution is right, these are uniform. Too many at both ends: the errors are larger than
stated; a slope: the prediction is too dark or too bright.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from ...statistics.student_t import DEGREES_OF_FREEDOM
from ..selection.cross_validation import HeldOutPrediction, regions
from ..solver.model_fit import ModelFit

Vector = NDArray[np.float64]

BINS = 10  # of the histogram: the first and the last together are outside the 80 % interval
INTERVAL = 0.9  # probability of the interval whose coverage is stated
CONFIDENCE = 0.95  # of the band, for all bins at once
DRAWS = 2000  # for the band


@dataclass(frozen=True)
class Calibration:
    """density: (BINS,) of the transformed held-out values, 1 where the model is right. low, high:
    (BINS,) the band in which a model that is right stays in all bins at once with probability
    CONFIDENCE. covered: fraction of the values inside the 90 % interval."""

    density: Vector
    low: Vector
    high: Vector
    covered: float

    @property
    def is_calibrated(self) -> bool:
        """Whether every bin is within the band."""
        return bool(((self.density >= self.low) & (self.density <= self.high)).all())

    @classmethod
    def of(cls, fit: ModelFit, held_out: HeldOutPrediction) -> Calibration:
        """held_out: prediction of the held-out regions of the fit. Regions, not pixels, are
        independent: the band comes from their differences."""
        good = np.isfinite(fit.deviation) & np.isfinite(held_out.residual)
        at = student_t.cdf(held_out.residual, DEGREES_OF_FREEDOM)
        _, region = np.unique(regions(fit), return_inverse=True)
        bins = np.minimum((at * BINS).astype(np.intp), BINS - 1)
        cell = (region.ravel()[:, None] * BINS + bins)[good]
        count = int(region.max()) + 1
        counts = np.bincount(cell, minlength=count * BINS).reshape(count, BINS).astype(float)
        total = max(counts.sum(), 1.0)
        density = BINS * counts.sum(axis=0) / total
        away = counts - counts.sum(axis=1, keepdims=True) * (density / BINS)
        errors = BINS * np.sqrt(np.sum(away**2, axis=0)) / total
        reach = _simultaneous(away) * errors
        edge = student_t.ppf((1 + INTERVAL) / 2, DEGREES_OF_FREEDOM)
        covered = float(np.mean(np.abs(held_out.residual[good]) < edge)) if good.any() else 0.0
        return cls(density, 1 - reach, 1 + reach, covered)


def _simultaneous(away: NDArray[np.float64]) -> float:
    """Standard errors within which all bins are with probability CONFIDENCE, by the multiplier
    bootstrap over regions. away: (regions, BINS) counts minus their expectation."""
    signs = np.random.default_rng(0).choice((-1.0, 1.0), (DRAWS, len(away)))
    spread = np.sqrt(np.sum(away**2, axis=0))
    most = np.abs(signs @ away / np.maximum(spread, 1e-30)).max(axis=1)
    return float(np.quantile(most, CONFIDENCE))
