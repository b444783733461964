"""Weights of cells: how many cells of one region of angle space count as one observation.

Errors of neighbouring cells are correlated: the basis' own error and errors of the scan are alike
in all of them. Treated as independent, the thousands of cells away from the highlight would
outweigh the few in it, and the posterior would be far too narrow. So every region of angle space
carries at most the weight of CELLS_PER_REGION independent cells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles
from .cells import AngleCells

# degrees, edges of the regions in θh
REGION_THETA_H = (1.0, 2.0, 4.0, 7.0, 11.0, 16.0, 22.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
REGION_THETA_D = 8.0  # degrees, width of a region in θd
CELLS_PER_REGION = 20.0  # a region weighs no more than so many independent cells


COLUMNS = int(np.ceil(90.0 / REGION_THETA_D))
REGIONS = (len(REGION_THETA_H) + 1) * COLUMNS


def cells_per_observation(cells: AngleCells) -> NDArray[np.float64]:
    """(m,) for each cell, how many cells of its region together weigh as much as one independent
    cell (at least 1). Cells with clipped samples do not reduce the weight of the others, because
    most of them are lower limits that the BRDF exceeds."""
    region = region_of(cells.angles)
    limited = cells.clipped.any(axis=1)
    measured = np.bincount(region, ~limited)[region]
    count = np.where(limited, np.maximum(np.bincount(region, limited)[region], measured), measured)
    return np.maximum(count / CELLS_PER_REGION, 1.0)


def region_of(angles: Angles) -> NDArray[np.intp]:
    """(n,) the region, of REGIONS, of directions (n,)."""
    row = np.searchsorted(np.radians(REGION_THETA_H), angles.theta_h)
    column = (np.degrees(angles.theta_d) / REGION_THETA_D).astype(np.intp)
    return np.asarray(row * COLUMNS + np.minimum(column, COLUMNS - 1), np.intp)
