"""Where camera and lamp of each photo are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Rig:
    """Of every photo of a capture. axes: (photos, 3, 3) unit rows: right, down and forward of the
    camera, scan frame. lamp: (photos, 3) position of its lamp, NaN for a distant light. mounted:
    (photos,) whether the lamp is fixed to the camera."""

    axes: NDArray[np.float64]
    lamp: NDArray[np.float64]
    mounted: NDArray[np.bool_]

    @classmethod
    def distant(cls, photos: int) -> Rig:
        """Photos under distant lights, whose cameras are not turned."""
        axes = np.broadcast_to(np.eye(3), (photos, 3, 3)).copy()
        return cls(axes, np.full((photos, 3), np.nan), np.zeros(photos, bool))
