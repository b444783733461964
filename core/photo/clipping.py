"""Find clipped pixels: saturated, or at the lowest value of the encoding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# of the largest value: demosaicing, sharpening and lossy compression blur the edge of clipping
CLIPPING_LEVEL = 0.99


def clipped(encoded: NDArray, top: float) -> NDArray[np.bool_]:
    """(h, w) where any channel of (h, w, c) is within 1 % of ``top``, the encoding's largest
    number (255, 65535, 1.0, or the saturation in linear units)."""
    return _extreme(np.maximum, encoded) >= CLIPPING_LEVEL * top


def black(encoded: NDArray) -> NDArray[np.bool_]:
    """(h, w) where any channel of (h, w, c) is at or below 0: its true value is unknown."""
    return _extreme(np.minimum, encoded) <= 0


def _extreme(which: np.ufunc, encoded: NDArray) -> NDArray:
    """(h, w) maximum or minimum over the channels; a loop over channels is much faster than a
    reduction along the last axis."""
    found = encoded[:, :, 0]
    for channel in range(1, encoded.shape[2]):
        found = which(found, encoded[:, :, channel])
    return np.asarray(found)
