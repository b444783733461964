"""Padding of maps beyond the borders of UV islands, so that filtering shows no seams."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

TEXELS_PER_MARGIN = 64  # one texel of margin for each so many texels of a side
MIN_MARGIN = 4  # texels
STRIP = 1024  # rows processed at once, to limit memory


def margin_of(size: int) -> int:
    """Width in texels of the padding in a texture of ``size`` texels a side."""
    return max(MIN_MARGIN, size // TEXELS_PER_MARGIN)


def dilated(
    images: list[NDArray], known: NDArray[np.bool_], margin: int
) -> tuple[list[NDArray], NDArray[np.bool_]]:
    """(the images (h, w, …), padded; (h, w) True where there is a value now).

    Each texel within ``margin`` of a known one takes the value of the nearest. known: (h, w).
    """
    out = [image.copy() for image in images]
    reached = known.copy()
    for first in range(0, len(known), STRIP):
        top, bottom = max(0, first - margin), min(len(known), first + STRIP + margin)
        near = known[top:bottom]
        if not near.any():
            continue
        away, (row, column) = ndimage.distance_transform_edt(~near, return_indices=True)
        keep = slice(first - top, min(first + STRIP, len(known)) - top)
        wanted = (away[keep] > 0) & (away[keep] <= margin)
        here = slice(first, first + STRIP)
        reached[here] |= wanted
        source = row[keep][wanted], column[keep][wanted]
        for image, target in zip(images, out, strict=True):
            target[here][wanted] = image[top:bottom][source]
    return out, reached
