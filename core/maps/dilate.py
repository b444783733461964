"""Maps continued beyond the borders of their islands: no seam shows when they are filtered."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

MARGIN = 64  # a texture of so many texels a side has a margin of one, at least LEAST
LEAST = 4
STRIP = 1024  # rows that are looked at together, and their margin: memory


def margin_of(size: int) -> int:
    """Texels that maps are continued by in a texture of ``size`` a side."""
    return max(LEAST, size // MARGIN)


def dilated(
    images: list[NDArray], known: NDArray[np.bool_], margin: int
) -> tuple[list[NDArray], NDArray[np.bool_]]:
    """(the images (h, w, …), each texel within ``margin`` of a known one as the nearest of them,
    (h, w) where there is a value now). known: (h, w)."""
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
