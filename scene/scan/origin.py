"""Where the scan's frame lies in Blender's world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FAR = 100.0  # sizes of the object: farther from the origin, Blender's float32 would lose precision


def frame_origin(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) the scan-frame point put at Blender's origin: zero, unless the scan's points (n, 3) are
    georeferenced or otherwise far away; then their centre, rounded to whole units."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre = 0.5 * (low + high)
    if np.linalg.norm(centre) <= FAR * np.linalg.norm(high - low):
        return np.zeros(3)
    return np.round(centre)
