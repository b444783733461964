"""Regions of angle space: what a photo adds is counted by region, as the fit weights its cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..fit.measured.cell_weights import COLUMNS, REGION_THETA_D, REGION_THETA_H, region_of

PHI_D_STEP = 30.0  # degrees: within it, the components of the basis change little

THETA_H_CENTRES = np.radians(
    [0.5 * (a + b) for a, b in zip((0.0, *REGION_THETA_H), (*REGION_THETA_H, 90.0), strict=True)]
)
ROWS = len(THETA_H_CENTRES)
AZIMUTHS = int(180.0 / PHI_D_STEP)
COUNT = ROWS * COLUMNS * AZIMUTHS


def centres() -> Angles:
    """(COUNT,) the middle of each part of a region: regions of θh and θd, divided in φd."""
    theta_d = np.radians(np.minimum((np.arange(COLUMNS) + 0.5) * REGION_THETA_D, 89.0))
    phi_d = np.radians((np.arange(AZIMUTHS) + 0.5) * PHI_D_STEP)
    each = np.meshgrid(THETA_H_CENTRES, theta_d, phi_d, indexing="ij")
    return Angles(*(a.ravel() for a in each))


def part_of(angles: Angles) -> NDArray[np.intp]:
    """(n,) in which of the COUNT parts directions (n,) are."""
    azimuth = (np.degrees(np.mod(angles.phi_d, np.pi)) / PHI_D_STEP).astype(np.intp)
    return region_of(angles) * AZIMUTHS + np.minimum(azimuth, AZIMUTHS - 1)


def region_of_part() -> NDArray[np.intp]:
    """(COUNT,) the region, of ROWS · COLUMNS, that each part belongs to."""
    return np.arange(COUNT) // AZIMUTHS
