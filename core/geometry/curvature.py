"""Screen-space mean curvature of the surface a photo sees (the paper's first reliability test)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def mean_curvature(normals: NDArray[np.floating]) -> NDArray[np.float32]:
    """(h, w) signed mean curvature, 1/pixel; NaN where a neighbour is missing.

    normals: (h, w, 3) unit, camera frame with x right, y down and z TOWARDS the camera; NaN where
    the photo sees no surface. g = (−nx/nz, −ny/nz) is the gradient of the depth the normals
    describe, H = ∇ᵀg its Hessian, and (κu + κv)/2 = tr H / 2
    (Vergne et al. 2009, "Light warping for enhanced surface depiction"; the paper, section 3.2).
    """
    facing = np.where(normals[..., 2] > 1e-3, normals[..., 2], np.nan)
    return slope_curvature(-normals[..., 0] / facing, -normals[..., 1] / facing)


def slope_curvature(g_x: NDArray[np.floating], g_y: NDArray[np.floating]) -> NDArray[np.float32]:
    """The same from the depth's gradient, (h, w) each: x right, y down, NaN for no surface."""
    curvature = np.full(g_x.shape, np.nan, np.float32)
    curvature[1:-1, 1:-1] = 0.25 * (
        (g_x[1:-1, 2:] - g_x[1:-1, :-2]) + (g_y[2:, 1:-1] - g_y[:-2, 1:-1])
    )
    return curvature
