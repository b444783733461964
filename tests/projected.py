"""Materials of another kind as BRDFs of the embedded basis."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from patina.core.angles import Angles, merl_grid
from patina.core.basis import PrincipalBRDF, default_basis


def projected(evaluate: Callable[[Angles], np.ndarray], count: int) -> PrincipalBRDF:
    """The nearest BRDF of ``count`` components to ``evaluate(angles) -> (n, 3)``."""
    centres = merl_grid.node_angles(0.5)
    seen = np.flatnonzero(merl_grid.visible(centres))
    chosen = np.random.default_rng(0).choice(seen, 20000, replace=False)
    angles = Angles(*(a.ravel()[chosen] for a in centres))
    basis = default_basis()
    return PrincipalBRDF(basis, basis.project(evaluate(angles), angles, count, eta=1.0))
