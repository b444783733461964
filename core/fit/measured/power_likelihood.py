"""Power likelihood: down-weight all observations of a material that the basis does not describe
well.

A material unlike all measured ones would need coefficients larger than those of measured materials,
and its BRDF would take implausible values in directions without samples. The model is misspecified
there, so the likelihood is raised to a power 1/temperature < 1, as in generalised (tempered)
Bayesian inference: Bissiri, Holmes and Walker 2016, "A general framework for updating belief
distributions"; Grünwald and van Ommen 2017, "Inconsistency of Bayesian inference for misspecified
linear models, and a proposal for repairing it". The temperature is raised until the coefficients
are no larger than the prior makes plausible, at most to MAX_TEMPERATURE.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .forward import CellModel
from .posterior import Posterior, solve
from .prior import ChannelPrior

MIN_TEMPERATURE, MAX_TEMPERATURE = 1.0, 4.0  # temperature: 1 is the ordinary likelihood
# largest mean square of the coefficients, in units of the prior's variance (1 if all are known)
MAX_MEAN_SQUARE = 0.4
ATTEMPTS = 4  # solutions, each with a higher temperature
STEPS_PER_ATTEMPT = 5  # Gauss–Newton steps of each


def normalised_mean_square(coefficients: NDArray[np.floating], prior: ChannelPrior) -> float:
    """Mean square of coefficients (3, k) in units of the prior's variance: 1 on average for a
    material like the measured ones of which all coefficients were known."""
    return float(np.mean(np.square(coefficients) / (prior.own + prior.shared)))


def solve_power_likelihood(
    model: CellModel,
    prior: ChannelPrior,
    floor: float,
    start: NDArray[np.float64] | None = None,
    temperature: float = MIN_TEMPERATURE,
) -> tuple[Posterior, float]:
    """(posterior, temperature) of a power likelihood, without the solutions that leave out a photo.

    start: (3, k) coefficients to start from; temperature: the one to start from. It is raised until
    the coefficients' mean square is at most MAX_MEAN_SQUARE, in at most ATTEMPTS solutions.
    """
    for _ in range(ATTEMPTS):
        found = solve(
            model,
            prior,
            floor,
            start,
            leave_out=False,
            iterations=STEPS_PER_ATTEMPT,
            temperature=temperature,
        )
        start = found.coefficients
        excess = normalised_mean_square(start, prior) / MAX_MEAN_SQUARE
        if excess <= 1.0 or temperature >= MAX_TEMPERATURE:
            break
        temperature = min(MAX_TEMPERATURE, temperature * float(np.clip(excess**1.2, 1.2, 4.0)))
    return found, temperature
