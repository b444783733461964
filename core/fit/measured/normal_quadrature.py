"""What a scan's normals are off by, as a handful of normals around the scanned one.

The mean radiance of samples with one scanned normal is that of the true normals behind it: a BRDF
blurred by their scatter. Predicting the blurred one is what keeps highlights from coming out low.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, half_difference, light_view

# Gauss–Laguerre in r²/2: a plane Gaussian is integrated exactly to the fifth power of r²
RADII = np.sqrt(2.0 * np.array([0.41577455678348, 2.29428036027904, 6.28994508293748]))
SHARES = np.array([0.711093009929173, 0.278517733569241, 0.010389256501586])
AROUND = (6, 8, 4)  # normals of each ring


def rings() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """((j, 2) offsets for unit standard deviation along each axis, (j,) weights that sum to 1)."""
    offsets, weights = [], []
    for ring, (radius, share, number) in enumerate(zip(RADII, SHARES, AROUND, strict=True)):
        turn = 2 * np.pi * (np.arange(number) + 0.5 * (ring % 2)) / number
        offsets.append(radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))
        weights.append(np.full(number, share / number))
    return np.concatenate(offsets), np.concatenate(weights)


def scattered(
    angles: Angles, deviation: NDArray[np.floating]
) -> tuple[Angles, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """(angles, cos θi, cos θo, all (m, j), and weights (j,)) of light and view at m directions as
    the normals around theirs see them. deviation: (m,) radians along each tangent."""
    light, view = light_view(*angles)
    if not np.any(deviation > 0):
        offsets, weights = np.zeros((1, 2)), np.ones(1)
    else:
        offsets, weights = rings()
    m, j = len(light), len(weights)
    normal = np.ones((m, j, 3))
    normal[..., :2] = offsets * np.tan(np.minimum(deviation, 0.3))[:, None, None]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    l, v = (np.broadcast_to(a[:, None], normal.shape) for a in (light, view))  # noqa: E741
    seen = half_difference(normal, l, v)
    cos_i = np.einsum("mjx,mjx->mj", normal, l)
    cos_o = np.einsum("mjx,mjx->mj", normal, v)
    return seen, cos_i, cos_o, weights
