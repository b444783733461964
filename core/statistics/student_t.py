"""Student's t distribution as a robust error model (Lange, Little and Taylor 1989).

With few degrees of freedom, outliers (an unexplained shadow, a misregistered pixel) get less weight
in the fit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

DEGREES_OF_FREEDOM = 4.0  # the value that Lange et al. recommend where it is not estimated


def robust_cost(residual: Array) -> Array:
    """Negative log-likelihood in nats, up to a constant, of residuals in units of their scale."""
    nu = DEGREES_OF_FREEDOM
    return (nu + 1) / 2 * np.log1p(np.square(residual) / nu)


def robust_weights(residual: Array) -> Array:
    """Weights of the squared residuals in Gauss–Newton; residuals are in units of their scale."""
    return weights_of_squares(np.square(residual))


def weights_of_squares(squares: Array) -> Array:
    """Weights of the squared residuals in Gauss–Newton, from squared residuals in units of their
    scale."""
    return (DEGREES_OF_FREEDOM + 1) / (DEGREES_OF_FREEDOM + squares)
