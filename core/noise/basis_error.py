"""How far a material that was not measured before is from its best representation in the basis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..basis import mapping

# Relative standard deviation of ρ·cosMap + ε for materials that are not in the basis: 0.16 at
# levels of 0.01 to 0.2, and larger below by about ε (`run.py bench basis`, "error by level").
BASIS_ERROR = 0.15
BASIS_ERROR_NEAR_BLACK = mapping.EPSILON


def basis_variance(
    level: NDArray[np.floating], relative: float = BASIS_ERROR
) -> NDArray[np.float64]:
    """Relative variance of the prediction of ``level`` = ρ·cosMap + ε. relative: standard deviation
    far from black."""
    return np.asarray(relative**2 + (BASIS_ERROR_NEAR_BLACK / level) ** 2)
