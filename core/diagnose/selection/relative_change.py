"""The relative difference of two predictions, as it is visible in the photos."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

WHITE = 90.0  # percentile of the selected pixels, many of which are in highlights


def relative_rms_change(
    shown: Array, other: Array, deviation: Array, highlights: bool = False
) -> float:
    """RMS difference of two predictions (n, 3), relative to the RMS of the first. Both are
    clipped at black and at the radiance that a photo would show as white; otherwise a highlight, a
    thousand times as bright as the rest, would dominate. highlights: clip at the brightest pixel
    instead.
    deviation: (n, 3), inf for pixels that do not count."""
    counted = np.isfinite(deviation).all(axis=1)
    if not counted.any():
        return 0.0
    if highlights:
        white = max(float(shown[counted].max()), float(other[counted].max()), 1e-30)
    else:
        white = max(float(np.percentile(shown[counted].max(axis=1), WHITE)), 1e-30)
    a, b = np.clip(shown[counted], 0, white), np.clip(other[counted], 0, white)
    return float(np.sqrt(np.sum((a - b) ** 2) / max(float(np.sum(a**2)), 1e-30)))
