"""How sure a fit is of its BRDF, over the directions that count, in three numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines
from ..basis import AngleGrid, Basis

SEEN = np.radians(80)  # light and view nearer to the normal than this
PEAK = np.radians(3)


@dataclass(frozen=True)
class Spread:
    """Standard deviation of ln(ρ·cosMap + ε), mean of the channels, over directions with light and
    view within 80° of the normal. Of the paper's fit: between its trials, NOT a calibrated
    interval. Of the measured fit: of what the photos leave possible."""

    median: float
    percentile_90: float
    at_highlight: float

    @staticmethod
    def of(deviation: NDArray[np.floating], angles: Angles) -> Spread:
        """deviation: (n, c) at directions (n,) within SEEN."""
        mean = deviation.mean(axis=1)
        return Spread(
            median=float(np.median(mean)),
            percentile_90=float(np.percentile(mean, 90)),
            at_highlight=float(np.median(mean[angles.theta_h < PEAK])),
        )


def directions(grid: AngleGrid) -> Angles:
    """Some of a grid's nodes, those within SEEN; each (n,)."""
    thin = (slice(None, None, 3), slice(None, None, 3), slice(None, None, 5))
    angles = Angles(*(a[thin].ravel() for a in grid.nodes()))
    near = np.minimum(*cosines(*angles)) > np.cos(SEEN)
    return Angles(*(a[near] for a in angles))


def candidate_spread(basis: Basis, candidates: NDArray[np.floating]) -> Spread:
    """How far the candidates (trials, 3, k) of the paper's fit disagree."""
    angles = directions(basis.grid)
    trials, channels, k = candidates.shape
    centre, q = basis.rows(angles, k)
    logs = centre[:, None] + q @ candidates.reshape(-1, k).T
    return Spread.of(logs.reshape(-1, trials, channels).std(axis=1), angles)
