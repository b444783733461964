"""Remaining structure: correlated residuals of neighbouring pixels that no cause explains."""

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

REACH = 1.5  # cells; neighbours within this distance of a pixel are used
NEIGHBOURS = 48  # at most
MIN_STANDARD_ERRORS = 3.0  # of the gain over cells
MIN_CHANGE = 0.012  # RMS of the structure relative to the photos, below which it is not reported,
LARGE_GAIN = 0.007  # nats per pixel and channel, unless it gains this much
ACROSS = (18, 40)  # cells along the longer side of a photo: for coarse structure, and for fine
SHRINKAGE = 4.0  # weight of a prior mean of 0, in neighbours at distance 0


@dataclass(frozen=True)
class ResidualStructure:
    """gain: nats by which a pixel's neighbours improve its prediction; error: its standard error
    over cells. change: RMS of the structure, relative to the photos. structure: (n, 3) radiance
    that the photos show in excess of the prediction. photo: (n,) number of each
    pixel's photo."""

    gain: float
    error: float
    change: float
    structure: Array
    photo: NDArray[np.int16]

    @property
    def is_significant(self) -> bool:
        """Whether it is more than chance, and large enough to be reported."""
        large = self.gain > LARGE_GAIN * self.structure.size
        return self.gain > MIN_STANDARD_ERRORS * self.error and (self.change > MIN_CHANGE or large)

    def sentence(self) -> str:
        """The unexplained structure in words, for an artist."""
        strength = np.bincount(self.photo, np.sum(self.structure**2, axis=1))
        part = strength / max(float(strength.sum()), 1e-30)
        worst = int(np.argmax(part))
        return (
            f"{100 * self.change:.1f} % of the light in the photos is not explained by any known "
            f"cause. {100 * part[worst]:.0f} % of that is in photo {worst + 1}."
        )


def residual_structure(fitted: ModelFit) -> ResidualStructure:
    """How well a pixel's residual is predicted by neighbours in the same photo that lie in other
    cells; at the cell size with the largest gain."""
    return max(
        (_structure_at_scale(fitted, across) for across in ACROSS), key=lambda found: found.gain
    )


def _structure_at_scale(fitted: ModelFit, across: int) -> ResidualStructure:
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
    # outliers are clipped: this approximates the robust score
    residual = np.clip(fitted.residual, -3, 3)
    total = weight.sum(axis=1)
    mean = np.stack([np.sum(weight * residual[which, c], axis=1) for c in range(3)], axis=1)
    mean /= (total + SHRINKAGE)[:, None]
    gains = (robust_cost(fitted.residual) - robust_cost(fitted.residual - mean)).sum(axis=1)
    gained = sum_by_region(cell, gains)
    structure = mean * np.where(np.isfinite(fitted.deviation), fitted.deviation, 0.0)
    size = relative_rms_change(fitted.predicted, fitted.predicted + structure, fitted.deviation)
    return ResidualStructure(
        float(gained.sum()), standard_error_of_sum(gained), size, structure, pixels.photo
    )
