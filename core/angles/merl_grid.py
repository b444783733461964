"""The MERL grid (Matusik et al. 2003): 90 × 90 × 180 cells over (θh, θd, φd), spaced in the square
root of θh.

Index order is (θh, θd, φd), φd fastest. Cell (ih, id, ip) covers θh from 90°·(ih/90)² to
90°·((ih+1)/90)², θd from id° to id+1°, φd from ip° to ip+1°.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .half_difference import Angles, cosines, fold_phi_d

SHAPE = (90, 90, 180)
HALF_PI = np.pi / 2


def index(angles: Angles) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Cell (ih, id, ip) that contains each direction; angles in radians, φd is folded to [0, π)."""
    ih = np.floor(90.0 * np.sqrt(np.clip(angles.theta_h / HALF_PI, 0.0, None))).astype(np.intp)
    idx = np.floor(np.degrees(angles.theta_d)).astype(np.intp)
    ip = np.floor(np.degrees(fold_phi_d(angles.phi_d))).astype(np.intp)
    return np.clip(ih, 0, 89), np.clip(idx, 0, 89), np.clip(ip, 0, 179)


def node_angles(offset: float = 0.5) -> Angles:
    """Angles of all cells, each array (90, 90, 180) float64, radians.

    offset: 0.5 for cell centres, as in all tables that Patina writes; 0 for the lower edges, where
    the neural encodings of Sztrajman et al. were sampled.
    """
    theta_h = HALF_PI * ((np.arange(90) + offset) / 90.0) ** 2
    theta_d = np.radians(np.arange(90) + offset)
    phi_d = np.radians(np.arange(180) + offset)
    return Angles(*np.meshgrid(theta_h, theta_d, phi_d, indexing="ij"))


def visible(angles: Angles) -> NDArray[np.bool_]:
    """Where light and view are both above the horizon."""
    cos_i, cos_o = cosines(*angles)
    return (cos_i > 0) & (cos_o > 0)
