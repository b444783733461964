"""Means of the residual, weighted by the inverse variance of pixels, with errors over regions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

MAX_WEIGHT = 100.0  # of a pixel, relative to the median, so that no outlier makes a mean


@dataclass(frozen=True)
class WeightedMeans:
    """mean: (b,) residual relative to the prediction, of each bin. error: (b,) standard errors,
    with regions of the photos as independent units. Both NaN where a bin has too few pixels."""

    mean: NDArray[np.float64]
    error: NDArray[np.float64]


def weighted_means(
    where: NDArray[np.integer],
    bins: int,
    min_pixels: int,
    residual: Array,
    shown: Array,
    deviation: Array,
    block: NDArray[np.integer],
) -> WeightedMeans:
    """where: (n,) bin of each pixel. min_pixels: that a bin needs. residual: (n, 3) photo minus
    prediction, in units of the deviation; shown: (n, 3) prediction, with a positive mean;
    deviation: (n, 3) finite standard deviations of the residual; block: (n,) region of each
    pixel."""
    ratio = np.asarray(shown, np.float64) / deviation
    weight = np.sum(ratio**2, axis=1)
    pull = np.sum(ratio * residual, axis=1)
    limit = MAX_WEIGHT * np.median(weight) if len(weight) else 1.0
    pull, weight = pull * np.minimum(1, limit / weight), np.minimum(weight, limit)
    total, sums = (np.bincount(where, values, bins) for values in (weight, pull))
    enough = np.bincount(where, minlength=bins) >= min_pixels
    mean = sums / np.maximum(total, 1e-30)
    regions = int(block.max(initial=0)) + 1
    away = np.bincount(where * regions + block, pull - mean[where] * weight, bins * regions)
    error = np.sqrt(np.sum(away.reshape(bins, regions) ** 2, axis=1)) / np.maximum(total, 1e-30)
    return WeightedMeans(np.where(enough, mean, np.nan), np.where(enough, error, np.nan))
