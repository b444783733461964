"""A diffuse term and two microfacet lobes fitted to the cells, to extrapolate where there are no
samples.

Principal components describe measured materials; outside the sampled directions their sum can take
implausible values at grazing angles. A microfacet lobe cannot. The lobes are never the result:
their prediction is a pseudo-observation of low weight in directions without samples
(grazing_prior.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...angles import Angles, cosines
from ...basis import mapping
from .cells import AngleCells

Array = NDArray[np.float64]

LOBES = 2
MAX_CELLS = 1500  # cells that are fitted
MIN_COSINE = 0.05  # cosines are clamped to it: the microfacet formula has poles at 0
STARTS = ((0.05, 0.3), (0.01, 0.1), (0.2, 0.6))  # roughnesses to start from
SOFT_L1_SCALE = 0.2  # log residual beyond which the soft-L1 loss turns linear
# bounds of the parameters
LOW = np.array([-12.0] * 3 + [np.log(0.003), -5.0, -14.0, -14.0, -14.0] * LOBES)
HIGH = np.array([1.0] * 3 + [np.log(0.9), 5.0, 2.0, 2.0, 2.0] * LOBES)


@dataclass(frozen=True)
class Lobes:
    """parameters: ln diffuse (3), then per lobe ln α, logit F0, ln strength (3). misfit: RMS of the
    log residuals."""

    parameters: Array
    misfit: float

    def evaluate(self, angles: Angles) -> Array:
        """ρ (n, 3) in 1/sr: GGX distribution (Walter et al. 2007, equation 33), height-correlated
        Smith shadowing, Schlick's Fresnel."""
        return _evaluate(self.parameters, angles)


def fit_lobes(cells: AngleCells, seed: int = 0) -> Lobes:
    """Least squares in the mapped space over a random subset of the cells, from several starts."""
    rng = np.random.default_rng(seed)
    some = cells.select(np.sort(rng.choice(len(cells), min(MAX_CELLS, len(cells)), replace=False)))
    cos_i, _ = cosines(*some.angles)
    weight = mapping.cos_map(some.angles)[:, None]
    rho = np.maximum(some.reflected, 0.0) / np.maximum(cos_i, MIN_COSINE)[:, None]
    target = np.log(rho * weight + mapping.EPSILON)
    diffuse = np.log(np.maximum(np.percentile(rho, 20, axis=0), 1e-3))

    def misfit(x: Array) -> Array:
        return (np.log(_evaluate(x, some.angles) * weight + mapping.EPSILON) - target).ravel()

    best = None
    for roughness in STARTS:
        start = [*diffuse]
        for alpha in roughness:
            start += [np.log(alpha), -2.0, -4.0, -4.0, -4.0]
        found = least_squares(
            misfit,
            np.clip(start, LOW, HIGH),
            bounds=(LOW, HIGH),
            loss="soft_l1",
            f_scale=SOFT_L1_SCALE,
            max_nfev=60,
        )
        if best is None or found.cost < best.cost:
            best = found
    assert best is not None
    return Lobes(best.x, float(np.sqrt(np.mean(best.fun**2))))


def _evaluate(x: Array, angles: Angles) -> Array:
    """ρ (n, 3) in 1/sr of the lobes with parameters x."""
    cos_i, cos_o = (np.maximum(c, MIN_COSINE) for c in cosines(*angles))
    cos_h, cos_d = np.cos(angles.theta_h), np.cos(angles.theta_d)
    rho: Array = np.exp(x[:3]) * np.ones((len(cos_h), 1))
    for lobe in range(LOBES):
        log_alpha, logit, *strength = x[3 + 5 * lobe : 8 + 5 * lobe]
        a2 = np.exp(2 * log_alpha)
        f0 = 1 / (1 + np.exp(-logit))
        distribution = a2 / (np.pi * (cos_h**2 * (a2 - 1) + 1) ** 2)
        fresnel = 1 + (1 / f0 - 1) * (1 - cos_d) ** 5  # 1 at normal incidence: strength has F0
        smith_lambda = sum((-1 + np.sqrt(1 + a2 * (1 - c**2) / c**2)) / 2 for c in (cos_i, cos_o))
        value = distribution * fresnel / ((1 + smith_lambda) * 4 * cos_i * cos_o)
        rho = rho + value[:, None] * np.exp(strength)
    return rho
