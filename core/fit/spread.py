"""Uncertainty of a fit's BRDF over the relevant directions, in three numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines
from ..basis import AngleGrid, Basis

MAX_THETA = np.radians(80)  # of light and view from the normal
HIGHLIGHT = np.radians(3)  # θh below which a direction counts to the highlight


@dataclass(frozen=True)
class Spread:
    """Standard deviation of ln(ρ·cosMap + ε), mean of the channels, over directions with light and
    view within 80° of the normal. For the paper's fit: the spread of its trials, NOT a calibrated
    interval. For the measured fit: that of its posterior."""

    median: float
    percentile_90: float
    at_highlight: float

    @staticmethod
    def of(deviation: NDArray[np.floating], angles: Angles) -> Spread:
        """deviation: (n, c) standard deviations at directions (n,) within MAX_THETA."""
        mean = deviation.mean(axis=1)
        return Spread(
            median=float(np.median(mean)),
            percentile_90=float(np.percentile(mean, 90)),
            at_highlight=float(np.median(mean[angles.theta_h < HIGHLIGHT])),
        )


def directions(grid: AngleGrid) -> Angles:
    """Every third (φd: fifth) of a grid's nodes within MAX_THETA; each array (n,)."""
    thin = (slice(None, None, 3), slice(None, None, 3), slice(None, None, 5))
    angles = Angles(*(a[thin].ravel() for a in grid.nodes()))
    near = np.minimum(*cosines(*angles)) > np.cos(MAX_THETA)
    return Angles(*(a[near] for a in angles))


def candidate_spread(basis: Basis, candidates: NDArray[np.floating]) -> Spread:
    """Spread of the candidates (trials, 3, k) of the paper's fit."""
    angles = directions(basis.grid)
    trials, channels, k = candidates.shape
    centre, q = basis.rows(angles, k)
    logs = centre[:, None] + q @ candidates.reshape(-1, k).T
    return Spread.of(logs.reshape(-1, trials, channels).std(axis=1), angles)
