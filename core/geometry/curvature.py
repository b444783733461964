"""Screen-space mean curvature of the visible surface, the paper's first reliability test (Ono et
al. 2019, section 3.2, equations (5)–(7))."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def mean_curvature(normals: NDArray[np.floating]) -> NDArray[np.float32]:
    """(h, w) signed mean curvature H = (κu + κv)/2, 1/pixel; NaN where a neighbour is missing.

    normals: (h, w, 3) unit, camera frame with x right, y down and z TOWARDS the camera; NaN where
    no surface is visible. Computes the image-space gradient of the depth, g = (−nx/nz, −ny/nz):
    equation (5) of Ono et al. 2019. Its divergence gives the curvature, equations (6) and (7): see
    slope_curvature. The method is that of Vergne et al. 2009, "Light warping for enhanced surface
    depiction".
    """
    facing = np.where(normals[..., 2] > 1e-3, normals[..., 2], np.nan)
    return slope_curvature(-normals[..., 0] / facing, -normals[..., 1] / facing)


def slope_curvature(g_x: NDArray[np.floating], g_y: NDArray[np.floating]) -> NDArray[np.float32]:
    """(h, w) mean curvature H = (κu + κv)/2 from the gradient of the depth: equations (6) and (7)
    of Ono et al. 2019. It is half the trace of the Hessian ∇ᵀg, here by central differences,
    1/pixel.

    g_x, g_y: (h, w) gradient g of equation (5), x right, y down, NaN where no surface is visible.
    The result is NaN at the border and next to NaN.
    """
    curvature = np.full(g_x.shape, np.nan, np.float32)
    curvature[1:-1, 1:-1] = 0.25 * (
        (g_x[1:-1, 2:] - g_x[1:-1, :-2]) + (g_y[2:, 1:-1] - g_y[:-2, 1:-1])
    )
    return curvature
