"""Project any BRDF on the embedded basis."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from patina.core.angles import Angles, merl_grid
from patina.core.basis import PrincipalBRDF, default_basis


def projected(evaluate: Callable[[Angles], np.ndarray], count: int) -> PrincipalBRDF:
    """Return the projection of ``evaluate(angles) -> (n, 3)`` on ``count`` components."""
    centres = merl_grid.node_angles(0.5)
    visible = np.flatnonzero(merl_grid.visible(centres))
    selected = np.random.default_rng(0).choice(visible, 20000, replace=False)
    angles = Angles(*(a.ravel()[selected] for a in centres))
    basis = default_basis()
    return PrincipalBRDF(basis, basis.project(evaluate(angles), angles, count, eta=1.0))
