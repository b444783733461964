"""Structure that is left: what pixels miss is alike among neighbours, and no cause explains it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..pixels.image_cells import cell_coordinates, cell_numbers, separated_positions
from ..solver.model_fit import ModelFit, robust_cost
from .cross_validation import standard_error_of_sum, sum_by_region
from .relative_change import relative_rms_change

Array = NDArray[np.floating]

REACH = 1.5  # small squares about a pixel that are looked at
NEIGHBOURS = 48
SURE = 3.0  # standard errors over squares
LEAST = 0.012  # RMS of the photos that the structure amounts to,
PLAIN = 0.007  # nats a pixel and channel, unless it gains this much
ACROSS = (18, 40)  # small squares along a photo's longer side: coarse structure, and fine
SHRINK = 4.0  # neighbours' worth of doubt


@dataclass(frozen=True)
class ResidualStructure:
    """gain: nats that a pixel's neighbours predict it better; error: over squares. change: RMS of
    the structure, relative to the photos. structure: (n, 3) radiance that photos show more."""

    gain: float
    error: float
    change: float
    structure: Array
    photo: NDArray[np.int16]

    @property
    def is_significant(self) -> bool:
        """Whether it is there."""
        plain = self.gain > PLAIN * self.structure.size
        return self.gain > SURE * self.error and (self.change > LEAST or plain)

    def sentence(self) -> str:
        """For an artist."""
        strength = np.bincount(self.photo, np.sum(self.structure**2, axis=1))
        part = strength / max(float(strength.sum()), 1e-30)
        worst = int(np.argmax(part))
        return (
            f"something else is there, {100 * self.change:.1f} % of the photos' light, that no "
            f"cause explains; photo {worst + 1} holds {100 * part[worst]:.0f} % of it"
        )


def residual_structure(fitted: ModelFit) -> ResidualStructure:
    """What neighbours in a photo, of other small squares than a pixel's own, say about it: at the
    scale where they say most."""
    return max((_leftover(fitted, across) for across in ACROSS), key=lambda found: found.gain)


def _leftover(fitted: ModelFit, across: int) -> ResidualStructure:
    pixels = fitted.model.pixels
    column, row = cell_coordinates(pixels.photo, pixels.x, pixels.y, across)
    cell = cell_numbers(pixels.photo, pixels.x, pixels.y, across)
    place = separated_positions(pixels.photo, column, row)
    counted = np.flatnonzero(np.isfinite(fitted.deviation).all(axis=1))
    near, which = cKDTree(place[counted]).query(
        place, min(NEIGHBOURS, len(counted)), distance_upper_bound=REACH
    )
    there = np.isfinite(near)
    which = counted[np.where(there, which, 0)]
    weight = np.where(there & (cell[which] != cell[:, None]), np.exp(-near), 0.0)
    # a pixel that is far off says little: the robust score, whose sum is what a shift gains
    missed = np.clip(fitted.residual, -3, 3)
    total = weight.sum(axis=1)
    mean = np.stack([np.sum(weight * missed[which, c], axis=1) for c in range(3)], axis=1)
    mean /= (total + SHRINK)[:, None]
    gains = (robust_cost(fitted.residual) - robust_cost(fitted.residual - mean)).sum(axis=1)
    gained = sum_by_region(cell, gains)
    structure = mean * np.where(np.isfinite(fitted.deviation), fitted.deviation, 0.0)
    size = relative_rms_change(fitted.predicted, fitted.predicted + structure, fitted.deviation)
    return ResidualStructure(
        float(gained.sum()), standard_error_of_sum(gained), size, structure, pixels.photo
    )
