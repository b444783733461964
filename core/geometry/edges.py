"""Silhouettes and shadow edges: where a pixel of error puts a sample on another surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, generate_binary_structure

# A surface seen at 85° recedes 11 pixel footprints a pixel; more is a jump to another surface
STEEPEST_SLOPE = 12.0


def silhouette(depth: NDArray[np.floating], footprint: NDArray[np.floating]) -> NDArray[np.bool_]:
    """(h, w) pixels on either side of an outline or of a jump in depth.

    depth: (h, w) along the ray, NaN where nothing is hit; footprint: (h, w) a pixel's width there.
    """
    edge = np.zeros(depth.shape, bool)
    for axis in (0, 1):
        near = depth[:-1] if axis == 0 else depth[:, :-1]
        far = depth[1:] if axis == 0 else depth[:, 1:]
        width = footprint[:-1] if axis == 0 else footprint[:, :-1]
        with np.errstate(invalid="ignore"):
            jump = np.abs(far - near) > STEEPEST_SLOPE * width
        jump |= np.isnan(near) != np.isnan(far)
        if axis == 0:
            edge[:-1] |= jump
            edge[1:] |= jump
        else:
            edge[:, :-1] |= jump
            edge[:, 1:] |= jump
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
    for step in range(pixels):
        edge = binary_dilation(edge, generate_binary_structure(2, 1 + step % 2))
    return edge
