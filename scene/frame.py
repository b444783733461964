"""Where the scan's frame lies in Blender's world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..core.scan import Mesh

FAR = 100.0  # sizes of the object: farther from the origin, Blender's float32 would lose precision


def frame_origin(mesh: Mesh) -> NDArray[np.float64]:
    """(3,) the scan-frame point put at Blender's origin: zero, unless the scan is georeferenced
    or otherwise far away; then the mesh's centre, rounded to whole units."""
    centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    if np.linalg.norm(centre) <= FAR * mesh.size:
        return np.zeros(3)
    return np.round(centre)
