"""Slack of the basis: hat functions over θh and θd in addition to the principal components.

Every material is slightly outside the basis. Without slack, any effect that changes the shape of a
BRDF (a tone curve, a narrow lamp) could compensate for that and would be reported as a cause. A
little slack is always present; ``outside_basis`` is named where it becomes large. The overall
brightness is free: the brightest of the measured materials reflects a third of the light, and a
white wall, which is brighter at all angles alike, is not outside the basis for that reason.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...basis import Basis
from ...fit.measured.prior import CoefficientPrior

THETA_H = np.radians([0.0, 1.0, 2.0, 3.5, 5.0, 7.0, 10.0, 13.0, 17.0, 22.0, 30.0, 50.0, 90.0])
THETA_D = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0])
COUNT = len(THETA_H) * len(THETA_D)
LEVEL_SCALE = 1.0  # prior standard deviation of ln(ρ·cosMap + ε), common to all nodes
DEFAULT_SCALE = 0.05  # the same at each node


def with_slack(basis: Basis) -> Basis:
    """The basis with additional components: one that is 1 everywhere, and COUNT hat functions, each
    1 at its node and linear to 0 at the next nodes."""
    nodes = basis.grid.nodes()
    h, d = _hats(THETA_H, nodes.theta_h), _hats(THETA_D, nodes.theta_d)
    hats = np.einsum("ihdp,jhdp->ijhdp", h, d).reshape(COUNT, *basis.grid.shape)
    level = np.ones((1, *basis.grid.shape), np.float32)
    components = np.concatenate([basis.components, level, hats.astype(np.float32)])
    return replace(basis, components=components, training=None)


def variances(basis: Basis, slack: float) -> NDArray[np.float64]:
    """(k + 1 + COUNT,) prior variances of the coefficients of with_slack(basis). slack: standard
    deviation at each node."""
    # components for materials that are not in the database vary together: each alone varies less
    alone = 1 / np.diag(CoefficientPrior.of(basis, basis.count).precision)
    own = np.minimum(basis.coefficient_variance, alone)
    return np.concatenate([own, [LEVEL_SCALE**2], np.full(COUNT, slack**2)])


def _hats(nodes: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """(nodes, …) values of the hat function of each node at angles ``at`` (…)."""
    return np.stack([np.interp(at, nodes, row) for row in np.eye(len(nodes))])
