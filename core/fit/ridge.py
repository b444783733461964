"""Coefficients from few samples by ridge regression (Nielsen, Jensen and Ramamoorthi 2015, equation
(5)).

It solves the reduced system of the observed rows, equation (4) of Ono et al. 2019.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ETA = 40.0  # published by Nielsen et al.; corresponds to a log residual of 0.365 per sample


def solve(
    q: NDArray[np.floating], mapped: NDArray[np.floating], eta: float = ETA
) -> NDArray[np.float64]:
    """c = (Q̂ᵀQ̂ + ηI)⁻¹ Q̂ᵀ (x̂ − µ̂), for every channel: (c, k). Nielsen et al. 2015, equation
    (5).

    q: (n, k) rows of scaled components; mapped: (n, c) centred, mapped observations; eta: ridge
    parameter.
    """
    q64 = q.astype(np.float64)
    normal = q64.T @ q64 + eta * np.eye(q.shape[1])
    return np.linalg.solve(normal, q64.T @ mapped.astype(np.float64)).T
