"""Room for what no mixture of measured materials makes: hats over θh and θd beside the components.

Every material is a little outside the basis. Without some slack whatever bends a BRDF's shape (a
tone curve, a narrow lamp) would be taken up for the material's sake, and named as a cause. A little
is always there; ``outside_basis`` is named where much more is asked for. How bright a material is
as a whole is no shape: the brightest one that was measured sends back a third of the light, and a
white wall, which is brighter at all angles alike, is not outside for that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...basis import Basis

THETA_H = np.radians([0.0, 1.0, 2.0, 3.5, 5.0, 7.0, 10.0, 13.0, 17.0, 22.0, 30.0, 50.0, 90.0])
THETA_D = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0])
COUNT = len(THETA_H) * len(THETA_D)
BRIGHTER = 1.0  # of ln(ρ·cosMap + ε), at all nodes alike
TINY, LITTLE, MUCH = 0.003, 0.05, 0.5  # of ln(ρ·cosMap + ε), at each node


def with_slack(basis: Basis) -> Basis:
    """The basis with components more: one that is 1 everywhere, and COUNT hats, 1 at a node and
    linear to the next ones."""
    nodes = basis.grid.nodes()
    h, d = _hats(THETA_H, nodes.theta_h), _hats(THETA_D, nodes.theta_d)
    hats = np.einsum("ihdp,jhdp->ijhdp", h, d).reshape(COUNT, *basis.grid.shape)
    level = np.ones((1, *basis.grid.shape), np.float32)
    components = np.concatenate([basis.components, level, hats.astype(np.float32)])
    return replace(basis, components=components, training=None)


def variances(basis: Basis, slack: float) -> NDArray[np.float64]:
    """(k + 1 + COUNT,) of the coefficients of with_slack(basis) before a photo is seen."""
    own = np.full(basis.count, basis.coefficient_variance)
    return np.concatenate([own, [BRIGHTER**2], np.full(COUNT, slack**2)])


def _hats(nodes: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """(nodes, …) weights of each at every angle."""
    return np.stack([np.interp(at, nodes, row) for row in np.eye(len(nodes))])
