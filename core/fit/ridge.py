"""Coefficients from few samples: Nielsen's ridge regression (Nielsen et al. 2015, equation 5;
the paper's equation 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ETA = 40.0  # Nielsen's published value: an assumed log residual of 0.365 a sample


def solve(
    q: NDArray[np.floating], mapped: NDArray[np.floating], eta: float = ETA
) -> NDArray[np.float64]:
    """c = (Q̂ᵀQ̂ + ηI)⁻¹ Q̂ᵀ (x̂ − µ̂), for every channel: (c, k).

    q: (n, k) rows of scaled components; mapped: (n, c) centred, mapped observations.
    """
    q64 = q.astype(np.float64)
    normal = q64.T @ q64 + eta * np.eye(q.shape[1])
    return np.linalg.solve(normal, q64.T @ mapped.astype(np.float64)).T
