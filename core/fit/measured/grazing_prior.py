"""Weak observations towards grazing light, where no photo looked.

Two guesses meet halfway there, in the logarithm: that ρ·cosMap stays what it is at the most grazing
angle that photos saw, which is what measured materials do on average; and that the BRDF goes on as
the lobes do, whose Fresnel term and shadowing know how glossy materials grow, but overdo it. The
lobes are first brought to the level of the BRDF over the last angles seen, not at the edge alone,
where samples are few.
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
BEYOND = 3.0  # degrees between rows of anchors, the first so far from what was seen
PHI_D = (15.0, 45.0, 75.0, 105.0, 135.0, 165.0)
LIMIT = 83.0  # of light and view
INDEPENDENT = 50.0  # their errors go together: all of them count as so many
NEAR_HIGHLIGHT = 15.0  # degrees of θh: cells that say how far highlights were seen
SEEN = 0.97  # of those cells
INSIDE = 2.0  # degrees: the edge that is carried on lies so far inside
LEVELS = (0.0, 10.0)  # degrees inside it, where the lobes' level is found
HALFWAY = 0.5  # of the lobes' change; all of it is too much, none too little


@dataclass(frozen=True)
class Anchors:
    """What the anchors add to the normal equations, per unit of 1/deviation²: gram (k, k), the
    same for all channels; pull (3, k)."""

    gram: NDArray[np.float64]
    pull: NDArray[np.float64]

    @classmethod
    def of(
        cls, lobes: Lobes, basis: Basis, coefficients: NDArray[np.float64], edge: float
    ) -> Anchors:
        """coefficients: (3, k) of the BRDF that is carried on from θd = edge (radians)."""
        k = coefficients.shape[1]
        edge = max(edge - np.radians(INSIDE), 0.0)
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

        seen = [at(edge - np.radians(inside)) for inside in LEVELS]
        level = np.mean([known(where) - of_lobes(where) for where in seen], axis=0)
        expected = (1 - HALFWAY) * known(at(edge)) + HALFWAY * (of_lobes(angles) + level)
        centre, rows = basis.rows(angles, k)
        q = rows.astype(np.float64)
        mapped = expected - centre[:, None]
        weight = INDEPENDENT / len(q)
        return cls(weight * q.T @ q, weight * (mapped.T @ q))


def carried_on(model: CellModel, coefficients: NDArray[np.float64]) -> Anchors:
    """Anchors beyond what a model's cells saw, from the BRDF found there."""
    edge = seen_edge(model.cells)
    return Anchors.of(fit_lobes(model.cells), model.basis, coefficients, edge)


def seen_edge(cells: AngleCells) -> float:
    """The θd, radians, up to which photos saw highlights."""
    near = cells.angles.theta_h < np.radians(NEAR_HIGHLIGHT)
    theta_d = cells.angles.theta_d[near] if near.sum() > 20 else cells.angles.theta_d
    return float(np.quantile(theta_d, SEEN))


def directions(edge: float) -> Angles:
    """Half/difference angles of the anchors beyond θd = edge, light and view within LIMIT."""
    theta_d = np.arange(np.degrees(edge) + BEYOND, LIMIT, BEYOND)
    grid = np.meshgrid(*(np.radians(a) for a in (THETA_H, theta_d, PHI_D)), indexing="ij")
    flat = [a.ravel() for a in grid]
    cos_i, cos_o = cosines(*flat)
    seen = np.minimum(cos_i, cos_o) > np.cos(np.radians(LIMIT))
    return Angles(*(a[seen] for a in flat))


def _logs(rho: NDArray[np.floating], angles: Angles) -> NDArray[np.float64]:
    """(n, 3) ln(ρ·cosMap + ε)."""
    return mapping.log_weighted(rho.astype(np.float64), mapping.cos_map(angles))
