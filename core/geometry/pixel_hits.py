"""The surface that single pixels of a photo show."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from .rays import Hits, RayScene

Array = NDArray[np.float64]


class PixelHits(NamedTuple):
    """Of n pixels, m show the mesh. hit: (n,) which; found: (m,) hits; view: (m, 3) unit vectors
    surface → camera, scan frame."""

    hit: NDArray[np.bool_]
    found: Hits
    view: Array


def pixel_hits(rays: RayScene, camera: Camera, pixels: Array) -> PixelHits:
    """First hits of the rays through image points (n, 2), in pixels from the top left corner.

    Points outside the valid part of the lens distortion do not hit.
    """
    directions = camera.rays(pixels)
    start = camera.ray_starts(pixels)
    if camera.orthographic:
        start = rays.just_before(start, directions)
    hits = rays.first_hits(start, np.nan_to_num(directions, nan=1.0))
    hit = (hits.face >= 0) & np.isfinite(directions).all(axis=1)
    return PixelHits(hit, hits.select(hit), -directions[hit])
