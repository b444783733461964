"""How many cells of a region of angle space count as one observation.

Cells err together: the components' own error, and what is wrong with the scan, is alike in
neighbouring cells. Taken for independent, the thousands beside the highlight would outvote the few
in it, and make the fit far too sure of itself. So no region has more votes than another.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .cells import AngleCells

THETA_H = (1.0, 2.0, 4.0, 7.0, 11.0, 16.0, 22.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)  # degrees
THETA_D = 8.0  # degrees; with the edges above, the regions
VOTES = 20.0  # of a region, cells' worth


def crowding(cells: AngleCells) -> NDArray[np.float64]:
    """(m,) how many cells of its region count as one, for each."""
    row = np.searchsorted(np.radians(THETA_H), cells.angles.theta_h)
    column = (np.degrees(cells.angles.theta_d) / THETA_D).astype(np.int64)
    region = row * 32 + column
    return np.maximum(np.bincount(region)[region] / VOTES, 1.0)
