"""Nielsen's log mapping of reflectance (Nielsen, Jensen, Ramamoorthi 2015, section 4).

mapped = ln((ρ·cosMap + ε) / (ref + ε)) with cosMap = clip(cos θi · cos θo, 0.01, 1), ε = 0.001 and
ref the median of ρ·cosMap over all training columns, for each direction. Differences of mapped
values are log-relative errors, which agree with perception, and highlights do not dominate the fit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines

EPSILON = 1e-3  # 1/sr, published by Nielsen et al.


def cos_map(angles: Angles) -> NDArray[np.floating]:
    """clip(cos θi · cos θo, 0.01, 1), in the shape of the angles."""
    cos_i, cos_o = cosines(*angles)
    return np.clip(cos_i * cos_o, 0.01, 1.0)


def log_weighted(rho: NDArray[np.floating], weight: NDArray[np.floating]) -> NDArray[np.floating]:
    """ln(ρ·cosMap + ε) for ρ (n, c) and cosMap (n,). Negative ρ (noise) is set to 0."""
    return np.log(np.maximum(rho, 0.0) * weight[:, None] + EPSILON)


def unlog_weighted(
    logarithm: NDArray[np.floating], weight: NDArray[np.floating]
) -> NDArray[np.floating]:
    """ρ (n, c) ≥ 0 in 1/sr from ln(ρ·cosMap + ε); 0 where the logarithm is below ln ε."""
    return np.maximum(np.exp(logarithm) - EPSILON, 0.0) / weight[:, None]
