"""Pixels that the file could not say more about: saturated, or at its lowest value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NEAR = 0.99  # of the top: demosaicing, sharpening and lossy compression blur the edge of clipping


def clipped(encoded: NDArray, top: float) -> NDArray[np.bool_]:
    """(h, w) where any channel of (h, w, c) is within 1 % of ``top``, the encoding's largest
    number (255, 65535, 1.0, or the saturation in linear units)."""
    return _extreme(np.maximum, encoded) >= NEAR * top


def black(encoded: NDArray) -> NDArray[np.bool_]:
    """(h, w) where any channel of (h, w, c) is at or below 0: what it was is not known."""
    return _extreme(np.minimum, encoded) <= 0


def _extreme(which: np.ufunc, encoded: NDArray) -> NDArray:
    """(h, w) over the channels: channel by channel, which is much faster than along them."""
    found = encoded[:, :, 0]
    for channel in range(1, encoded.shape[2]):
        found = which(found, encoded[:, :, channel])
    return np.asarray(found)
