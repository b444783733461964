"""Quadrature over the error of a scanned normal: a few normals around it, with weights.

The mean radiance of samples with the same scanned normal is the mean over the true normals behind
it, that is, a BRDF blurred by the distribution of the normals' errors. Predicting the blurred BRDF
avoids highlights that are estimated too low.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, half_difference, light_view

# Gauss–Laguerre nodes in r²/2: exact for a plane Gaussian times powers of r² up to the fifth
RADII = np.sqrt(2.0 * np.array([0.41577455678348, 2.29428036027904, 6.28994508293748]))
RING_WEIGHTS = np.array([0.711093009929173, 0.278517733569241, 0.010389256501586])
RING_COUNTS = (6, 8, 4)  # normals on each ring


def rings() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """((j, 2) offsets for unit standard deviation along each axis, (j,) weights that sum to 1)."""
    offsets, weights = [], []
    for ring, (radius, share, number) in enumerate(
        zip(RADII, RING_WEIGHTS, RING_COUNTS, strict=True)
    ):
        turn = 2 * np.pi * (np.arange(number) + 0.5 * (ring % 2)) / number
        offsets.append(radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))
        weights.append(np.full(number, share / number))
    return np.concatenate(offsets), np.concatenate(weights)


def quadrature_angles(
    angles: Angles, deviation: NDArray[np.floating]
) -> tuple[Angles, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """(angles, cos θi, cos θo, all (m, j), and weights (j,)): light and view of m directions
    relative to the quadrature normals around the normal.

    deviation: (m,) radians, standard deviation of the normal along each tangent.
    """
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
