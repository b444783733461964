"""Silhouettes and shadow edges: where a pixel of error puts a sample on another surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# A surface seen at 85° recedes 11 pixel footprints a pixel; more is a jump to another surface
STEEPEST_SLOPE = 12.0


def silhouette(depth: NDArray[np.floating], footprint: NDArray[np.floating]) -> NDArray[np.bool_]:
    """(h, w) pixels on either side of an outline or of a jump in depth.

    depth: (h, w) along the ray, NaN where nothing is hit; footprint: (h, w) a pixel's width there.
    """
    edge = np.zeros(depth.shape, bool)
    seen = ~np.isnan(depth)
    reach = STEEPEST_SLOPE * footprint
    for one, other in (
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
    ):
        with np.errstate(invalid="ignore"):
            jump = np.abs(depth[other] - depth[one]) > reach[one]
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
    """(h, w) pixels of ``part`` farther than ``margin`` pixels from surface that is not of it."""
    if margin <= 0:
        return part
    return part & ~widen(seen & ~part, margin)


def widen(edge: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """Everything within ``pixels`` of an edge pixel (diamonds and squares in turn: near a disc)."""
    if not edge.any():
        return edge
    for step in range(pixels):
        wider = edge.copy()
        wider[1:] |= edge[:-1]
        wider[:-1] |= edge[1:]
        # a diamond is a cross; a square is the column's run of three, widened along the row
        along = wider.copy() if step % 2 else edge
        wider[:, 1:] |= along[:, :-1]
        wider[:, :-1] |= along[:, 1:]
        edge = wider
    return edge
