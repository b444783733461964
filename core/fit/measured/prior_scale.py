"""How far a material is from the measured ones, estimated with its coefficients.

A material unlike all measured ones has coefficients that the prior finds implausible. The prior's
covariance is therefore multiplied by a scale for each material, which its cells determine: the mean
square of the coefficients that they determine, in units of the covariance (empirical Bayes; MacKay
1992, "Bayesian interpolation", equations 4.7 to 4.9). Such a material then follows its own photos
more than other materials, and its interval is wider where no photo shows it.
"""

from __future__ import annotations

import numpy as np

from .forward import CellModel
from .posterior import Posterior, solve
from .prior import CoefficientPrior

# a few determined coefficients say little about the scale: with so many more, of scale 1, as there
# are coefficients, it stays near 1 unless most of them are large
PRIOR_SHARE = 1.0
# 1: measured materials are no reason to trust a fit more; 10: the mean square of the coefficients
# of flaked paints, which are the farthest from the other measured materials, is 18
MIN_SCALE, MAX_SCALE = 1.0, 10.0
UPDATES = 3  # of the scale, after the first solution
STEPS = 5  # Gauss–Newton steps after an update, and from the solution of a model with other normals


def solve_with_scale(
    model: CellModel, prior: CoefficientPrior, floor: float
) -> tuple[Posterior, float]:
    """(posterior, scale of the prior's covariance), without the solutions that leave out a photo.

    floor: as in posterior.solve.
    """
    found, scale = solve(model, prior, floor, leave_out=False), 1.0
    for _ in range(UPDATES):
        scale = estimated_scale(found, prior, scale)
        found = _continued(model, prior.scaled(scale), floor, found)
    return found, scale


def solve_again(
    model: CellModel, prior: CoefficientPrior, floor: float, earlier: Posterior, scale: float
) -> tuple[Posterior, float]:
    """The same for a model that differs a little from the one of an earlier solution, from that
    solution and its scale. The scale that is returned is better than the one that was used."""
    found = _continued(model, prior.scaled(scale), floor, earlier)
    return found, estimated_scale(found, prior, scale)


def estimated_scale(found: Posterior, prior: CoefficientPrior, scale: float) -> float:
    """A better scale from a posterior that was computed with ``scale``."""
    size = found.coefficients.size
    unknown = sum(float(np.sum(prior.precision * own)) for own in found.covariance()) / scale
    determined = max(size - unknown, 0.0)
    squares = size * prior.mean_square(found.coefficients)
    expected = (squares + PRIOR_SHARE * size) / (determined + PRIOR_SHARE * size)
    return float(np.clip(expected, MIN_SCALE, MAX_SCALE))


def _continued(
    model: CellModel, prior: CoefficientPrior, floor: float, earlier: Posterior
) -> Posterior:
    """A few steps from an earlier solution."""
    start = earlier.coefficients
    return solve(model, prior, floor, start, leave_out=False, iterations=STEPS)
