"""How far the candidates of one fit disagree: the paper's method has no other uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines
from ..basis import Basis


@dataclass(frozen=True)
class Spread:
    """Standard deviation of ln(ρ·cosMap + ε) between the trials, over directions with light and
    view within 80° of the normal. Spread between random subsets, NOT a calibrated interval."""

    median: float
    percentile_90: float
    at_highlight: float


def candidate_spread(basis: Basis, candidates: NDArray[np.floating]) -> Spread:
    """candidates: (trials, 3, k)."""
    nodes = basis.grid.nodes()
    thin = (slice(None, None, 3), slice(None, None, 3), slice(None, None, 5))
    angles = Angles(*(a[thin].ravel() for a in nodes))
    cos_i, cos_o = cosines(*angles)
    near = np.minimum(cos_i, cos_o) > np.cos(np.radians(80))
    angles = Angles(*(a[near] for a in angles))
    trials, channels, k = candidates.shape
    centre, q = basis.rows(angles, k)
    logs = centre[:, None] + q @ candidates.reshape(-1, k).T
    deviation = logs.reshape(-1, trials, channels).std(axis=1).mean(axis=1)
    peak = angles.theta_h < np.radians(3)
    return Spread(
        median=float(np.median(deviation)),
        percentile_90=float(np.percentile(deviation, 90)),
        at_highlight=float(np.median(deviation[peak])),
    )
