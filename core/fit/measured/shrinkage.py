"""Shrink the most probable BRDF where it is uncertain.

Extrapolated highlights are wrong by factors, and an overestimate by a factor of three is worse than
an underestimate by the same factor: it adds more to ‖fit − truth‖/‖truth‖ and is more visible in a
picture. The value that minimises the expected relative error lies below the most probable one by a
multiple of the variance of the logarithm. Where photos have samples this variance is almost zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, cosines
from ...basis import Basis

SHRINKAGE = 0.5  # times the variance; 1.5 minimises E(ρ̂/ρ − 1)² of a log-normal ρ, 0 is its median
MAX_VARIANCE = 1.5  # the variance is clipped to it
MIN_VARIANCE = 0.02  # added in the weights, so that well-known directions count alike
NODES = 6000  # grid nodes of the least squares
RIDGE = 1e-6


def shrinkage_step(
    basis: Basis, covariance: NDArray[np.float64], seed: int = 0
) -> NDArray[np.float64]:
    """(3, k) change of coefficients with covariance (3, k, k) that lowers ln(ρ·cosMap + ε) by
    SHRINKAGE times its variance, by weighted least squares over random nodes of the grid."""
    k = covariance.shape[1]
    cos_i, cos_o = cosines(*(Angles(*(a.ravel() for a in basis.grid.nodes()))))
    visible = np.flatnonzero(np.minimum(cos_i, cos_o) > 0.01)
    some = np.random.default_rng(seed).choice(visible, min(NODES, len(visible)), replace=False)
    q = basis.nodes[np.sort(some), 1 : 1 + k].astype(np.float64)
    out = np.empty((len(covariance), k))
    for c, own in enumerate(covariance):
        variance = np.sum((q @ own) * q, axis=1)
        weighted = (q / (variance + MIN_VARIANCE)[:, None]).T
        down = weighted @ (-SHRINKAGE * np.minimum(variance, MAX_VARIANCE))
        out[c] = np.linalg.solve(weighted @ q + RIDGE * np.eye(k), down)
    return out
