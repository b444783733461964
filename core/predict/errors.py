"""Errors of a predicted photo, in the photo's own encoding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MIN_LEVEL = 1 / 255  # encoded; noise dominates the relative error of smaller values


@dataclass(frozen=True)
class PhotoErrors:
    """Errors of a prediction p of a photo y; both are encoded values, 0..1 for integer formats.

    typical: median of |p − y| / max(y, 1/255). relative_rms: √mean(p − y)² / √mean y².
    encoded_rmse: √mean(p − y)². All channels have the same weight. pixels: how many were compared;
    with none of them the errors are NaN.
    """

    typical: float
    relative_rms: float
    encoded_rmse: float
    pixels: int

    @classmethod
    def of(cls, predicted: NDArray[np.floating], measured: NDArray[np.floating]) -> PhotoErrors:
        """Errors of the pixels (n, 3) of one photo."""
        nan = float("nan")
        if not len(measured):
            return cls(nan, nan, nan, 0)
        y = measured.astype(np.float64)
        difference = predicted.astype(np.float64) - y
        rmse = float(np.sqrt(np.mean(np.square(difference))))
        size = float(np.sqrt(np.mean(np.square(y))))
        return cls(
            typical=float(np.median(np.abs(difference) / np.maximum(y, MIN_LEVEL))),
            relative_rms=rmse / size if size > 0 else nan,
            encoded_rmse=rmse,
            pixels=len(y),
        )

    @classmethod
    def mean(cls, photos: list[PhotoErrors]) -> PhotoErrors:
        """Mean of each error over the photos with pixels; ``pixels`` is their sum."""
        some = [p for p in photos if p.pixels]
        nan = float("nan")
        if not some:
            return cls(nan, nan, nan, 0)
        return cls(
            typical=float(np.mean([p.typical for p in some])),
            relative_rms=float(np.mean([p.relative_rms for p in some])),
            encoded_rmse=float(np.mean([p.encoded_rmse for p in some])),
            pixels=sum(p.pixels for p in some),
        )
