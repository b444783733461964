"""Offset between the scan's frame and Blender's world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MAX_DISTANCE = 100.0  # from the origin, in object sizes; beyond, Blender's float32 is too coarse


def frame_origin(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) point of the scan's frame that is placed at Blender's origin.

    points: (n, 3) of the scan. Zero, unless the points are far away (for example georeferenced);
    then their centre, rounded to whole units.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    centre = 0.5 * (low + high)
    if np.linalg.norm(centre) <= MAX_DISTANCE * np.linalg.norm(high - low):
        return np.zeros(3)
    return np.round(centre)
