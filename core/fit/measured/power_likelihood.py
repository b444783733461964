"""How much all cells count.

Cells of a material unlike all measured ones would need coefficients larger than measured materials
have, and run wild where no photo looked; then they are believed less, all of them alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .forward import CellModel
from .posterior import Posterior, solve
from .prior import ChannelPrior

LEAST, MOST = 1.0, 4.0  # regions' votes (cell_weights.py) for one
LARGEST = 0.4  # mean square of the coefficients, in units of the prior's variance
TRIES = 4
STEPS = 5  # of the solver, of each try


def size(coefficients: NDArray[np.floating], prior: ChannelPrior) -> float:
    """Mean square of coefficients (3, k) over what measured materials have: 1 on average for a
    material like them whose coefficients were all known."""
    return float(np.mean(np.square(coefficients) / (prior.own + prior.shared)))


def tempered(
    model: CellModel,
    prior: ChannelPrior,
    floor: float,
    start: NDArray[np.float64] | None = None,
    together: float = LEAST,
) -> tuple[Posterior, float]:
    """(solution without held-out photos, how many of a region's votes count as one); together:
    to begin with."""
    for _ in range(TRIES):
        found = solve(
            model, prior, floor, start, leave_out=False, iterations=STEPS, together=together
        )
        start = found.coefficients
        over = size(start, prior) / LARGEST
        if over <= 1.0 or together >= MOST:
            break
        together = min(MOST, together * float(np.clip(over**1.2, 1.2, 4.0)))
    return found, together
