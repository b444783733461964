"""How much two predictions differ, as a viewer of the photos would say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

WHITE = 90.0  # percentile of the pixels looked at, of which highlights are many


def relative_rms_change(
    shown: Array, other: Array, deviation: Array, highlights: bool = False
) -> float:
    """RMS between predictions (n, 3), relative to the first, both up to what a photo would be
    exposed to white: a highlight, a thousand times as bright as all else, would be all that counts.
    highlights: where they are what counts. deviation: (n, 3), inf for pixels that do not."""
    counted = np.isfinite(deviation).all(axis=1)
    if not counted.any():
        return 0.0
    if highlights:
        white = max(float(shown[counted].max()), float(other[counted].max()), 1e-30)
    else:
        white = max(float(np.percentile(shown[counted].max(axis=1), WHITE)), 1e-30)
    a, b = np.minimum(shown[counted], white), np.minimum(other[counted], white)
    return float(np.sqrt(np.sum((a - b) ** 2) / max(float(np.sum(a**2)), 1e-30)))
