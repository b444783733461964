"""The most probable BRDF made cautious where it is unsure.

Extrapolated highlights err by factors, and to be three times too bright is worse than to be three
times too dark: it costs more of ‖fit − truth‖/‖truth‖, and a picture forgives it less. The value
that makes the expected relative error least lies below the most probable one by a multiple of the
variance of the logarithm; where photos looked that is nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, cosines
from ...basis import Basis

CAUTION = 0.5  # times the variance; 1.5 is the least E(ρ̂/ρ − 1)² of a log-normal ρ, 0 its median
MOST = 1.5  # of the variance
SURE = 0.02  # variance: directions that are surer keep their value alike
NODES = 6000
STIFF = 1e-6


def caution(basis: Basis, covariance: NDArray[np.float64], seed: int = 0) -> NDArray[np.float64]:
    """(3, k) to add to coefficients of this covariance (3, k, k): it lowers ln(ρ·cosMap + ε) by
    CAUTION times its variance."""
    k = covariance.shape[1]
    cos_i, cos_o = cosines(*(Angles(*(a.ravel() for a in basis.grid.nodes()))))
    visible = np.flatnonzero(np.minimum(cos_i, cos_o) > 0.01)
    some = np.random.default_rng(seed).choice(visible, min(NODES, len(visible)), replace=False)
    q = basis.nodes[np.sort(some), 1 : 1 + k].astype(np.float64)
    out = np.empty((len(covariance), k))
    for c, own in enumerate(covariance):
        variance = np.sum((q @ own) * q, axis=1)
        weighted = (q / (variance + SURE)[:, None]).T
        down = weighted @ (-CAUTION * np.minimum(variance, MOST))
        out[c] = np.linalg.solve(weighted @ q + STIFF * np.eye(k), down)
    return out
