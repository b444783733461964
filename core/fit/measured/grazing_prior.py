"""Pseudo-observations of low weight at grazing angles that have no samples.

They average two extrapolations in the logarithm: that ρ·cosMap stays what it is at the most grazing
angle with samples, as it does on average for measured materials; and that the BRDF follows the
fitted microfacet lobes (lobes.py), whose Fresnel term and shadowing predict how glossy materials
rise, but overestimate it. The lobes are first scaled to the BRDF over the last degrees with
samples, not at the edge alone, where samples are few.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, cosines
from ...basis import Basis, mapping
from .cells import AngleCells
from .forward import CellModel
from .lobes import Lobes, fit_lobes

THETA_H = (0.2, 0.6, 1.2, 2.0, 4.0, 7.0, 12.0, 20.0, 30.0, 45.0)  # degrees
THETA_D_STEP = 3.0  # degrees between rows of pseudo-observations, the first so far from the edge
PHI_D = (15.0, 45.0, 75.0, 105.0, 135.0, 165.0)  # degrees
MAX_THETA = 83.0  # degrees of light and view from the normal
TOTAL_WEIGHT = 50.0  # observations: the errors are correlated, so all together count as so many
NEAR_HIGHLIGHT = 15.0  # degrees of θh: these cells tell how far highlights were sampled
EDGE_QUANTILE = 0.97  # of θd of those cells
MIN_CELLS = 50  # without clipped samples: with fewer, the lobes are fitted to all cells
EDGE_INSET = 2.0  # degrees: the extrapolation starts so far inside the edge
LEVEL_OFFSETS = (0.0, 10.0)  # degrees inside that, where the lobes are scaled to the BRDF
LOBE_SHARE = 0.5  # weight of the lobes: 1 overestimates grazing reflectance, 0 underestimates it


@dataclass(frozen=True)
class GrazingPrior:
    """Normal equations of the pseudo-observations, per unit of 1/(standard deviation)²: gram (k,
    k), the same for all channels; rhs (3, k), the right-hand side."""

    gram: NDArray[np.float64]
    rhs: NDArray[np.float64]

    @classmethod
    def of(
        cls, lobes: Lobes, basis: Basis, coefficients: NDArray[np.float64], edge: float
    ) -> GrazingPrior:
        """coefficients: (3, k) of the BRDF to extrapolate beyond θd = edge (radians)."""
        k = coefficients.shape[1]
        edge = max(edge - np.radians(EDGE_INSET), 0.0)
        angles = directions(edge)
        if not len(angles.theta_h):
            return cls(np.zeros((k, k)), np.zeros((3, k)))

        def at(theta_d: float) -> Angles:
            same = np.full_like(angles.theta_d, max(theta_d, 0.0))
            return Angles(angles.theta_h, same, angles.phi_d)

        def known(where: Angles) -> NDArray[np.float64]:
            return _logs(basis.evaluate(coefficients, where), where)

        def of_lobes(where: Angles) -> NDArray[np.float64]:
            return _logs(lobes.evaluate(where), where)

        seen = [at(edge - np.radians(inside)) for inside in LEVEL_OFFSETS]
        level = np.mean([known(where) - of_lobes(where) for where in seen], axis=0)
        expected = (1 - LOBE_SHARE) * known(at(edge)) + LOBE_SHARE * (of_lobes(angles) + level)
        centre, rows = basis.rows(angles, k)
        q = rows.astype(np.float64)
        mapped = expected - centre[:, None]
        weight = TOTAL_WEIGHT / len(q)
        return cls(weight * q.T @ q, weight * (mapped.T @ q))


def extrapolated(model: CellModel, coefficients: NDArray[np.float64]) -> GrazingPrior:
    """Pseudo-observations beyond the samples of a model's cells, extrapolated from the BRDF with
    these coefficients (3, k)."""
    measured = ~model.cells.clipped.any(axis=1)
    cells = model.cells.select(measured) if measured.sum() >= MIN_CELLS else model.cells
    edge = sampled_edge(cells)
    return GrazingPrior.of(fit_lobes(cells), model.basis, coefficients, edge)


def sampled_edge(cells: AngleCells) -> float:
    """The θd, radians, up to which highlights were sampled."""
    near = cells.angles.theta_h < np.radians(NEAR_HIGHLIGHT)
    theta_d = cells.angles.theta_d[near] if near.sum() > 20 else cells.angles.theta_d
    return float(np.quantile(theta_d, EDGE_QUANTILE))


def directions(edge: float) -> Angles:
    """Half/difference angles of the pseudo-observations beyond θd = edge (radians), light and view
    within MAX_THETA of the normal."""
    theta_d = np.arange(np.degrees(edge) + THETA_D_STEP, MAX_THETA, THETA_D_STEP)
    grid = np.meshgrid(*(np.radians(a) for a in (THETA_H, theta_d, PHI_D)), indexing="ij")
    flat = [a.ravel() for a in grid]
    cos_i, cos_o = cosines(*flat)
    seen = np.minimum(cos_i, cos_o) > np.cos(np.radians(MAX_THETA))
    return Angles(*(a[seen] for a in flat))


def _logs(rho: NDArray[np.floating], angles: Angles) -> NDArray[np.float64]:
    """(n, 3) ln(ρ·cosMap + ε)."""
    return mapping.log_weighted(rho.astype(np.float64), mapping.cos_map(angles))
