"""Silhouettes and shadow edges: pixels where an error of one pixel moves a sample to another
surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# pixel footprints of depth per pixel: a surface seen at 85° recedes by 11; more is a jump in depth
MAX_DEPTH_SLOPE = 12.0


def silhouette(depth: NDArray[np.floating], footprint: NDArray[np.floating]) -> NDArray[np.bool_]:
    """(h, w) pixels on either side of an outline or of a jump in depth.

    depth: (h, w) along the ray, scan units, NaN where no surface is hit; footprint: (h, w) width of
    a pixel at that depth, scan units.
    """
    edge = np.zeros(depth.shape, bool)
    seen = ~np.isnan(depth)
    max_step = MAX_DEPTH_SLOPE * footprint
    for one, other in (
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
    ):
        with np.errstate(invalid="ignore"):
            jump = np.abs(depth[other] - depth[one]) > max_step[one]
        jump |= seen[one] != seen[other]
        edge[one] |= jump
        edge[other] |= jump
    return edge


def shadow_edge(lit: NDArray[np.bool_], seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(h, w) pixels on either side of a boundary between light and shadow on the surface."""
    edge = np.zeros(lit.shape, bool)
    down = (lit[1:] != lit[:-1]) & seen[1:] & seen[:-1]
    edge[1:] |= down
    edge[:-1] |= down
    right = (lit[:, 1:] != lit[:, :-1]) & seen[:, 1:] & seen[:, :-1]
    edge[:, 1:] |= right
    edge[:, :-1] |= right
    return edge


def inside(part: NDArray[np.bool_], seen: NDArray[np.bool_], margin: int) -> NDArray[np.bool_]:
    """(h, w) pixels of ``part`` farther than ``margin`` pixels from other visible surface."""
    if margin <= 0:
        return part
    return part & ~widen(seen & ~part, margin)


def widen(edge: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """(h, w) pixels within ``pixels`` of an edge pixel, by alternating diamonds and squares (close
    to a disc)."""
    if not edge.any():
        return edge
    for step in range(pixels):
        wider = edge.copy()
        wider[1:] |= edge[:-1]
        wider[:-1] |= edge[1:]
        # diamond: a cross; square: a column of three pixels, widened along the row
        along = wider.copy() if step % 2 else edge
        wider[:, 1:] |= along[:, :-1]
        wider[:, :-1] |= along[:, 1:]
        edge = wider
    return edge
