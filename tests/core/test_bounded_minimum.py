"""The minimum of a quadratic cost within bounds, also where rounding has made it indefinite."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from patina.core.diagnose.selection.one_step import bounded_minimum

RNG = np.random.default_rng(5)


def test_it_is_the_minimum_that_a_general_solver_finds():
    root = RNG.normal(size=(4, 4))
    matrix, pull = root @ root.T + np.eye(4), 3 * RNG.normal(size=4)
    low, high = np.full(4, -0.3), np.full(4, 0.3)
    x, free = bounded_minimum(matrix, pull, low, high, 1.0)

    def cost(v: np.ndarray) -> float:
        return 0.5 * v @ matrix @ v - pull @ v

    expected = minimize(cost, np.zeros(4), bounds=list(zip(low, high, strict=True)), tol=1e-12).x
    assert x == pytest.approx(expected, abs=1e-4)
    assert (free == (np.abs(x) < 0.3 - 1e-9)).all()


def test_black_pixels_of_noise_free_photos_do_not_end_the_diagnosis():
    """A direction that weighs 10¹⁷ times the prior: rounding makes the others' curvature negative,
    for which there is no Cholesky decomposition."""
    prior, heavy = 400.0, RNG.normal(size=8)
    matrix = 1e17 * np.outer(heavy, heavy) + prior * np.eye(8)
    matrix += 1e9 * RNG.normal(size=(8, 8))  # of single precision
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0] < 0
    low, high = np.zeros(8), np.full(8, 2.0)
    x, free = bounded_minimum(matrix, -1e17 * heavy, low, high, prior)
    assert np.isfinite(x).all()
    assert ((x >= low - 1e-9) & (x <= high + 1e-9)).all()
    assert not free.all()
