"""Elimination of the patches of a surface from the normal equations."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.diagnose.solver.block_elimination import (
    inverse_of_blocks,
    patch_blocks,
    projected_squares,
)

PATCHES, EACH, ROWS = 5, 10, 4


def blocks_of(dominance: float, seed: int = 0) -> np.ndarray:
    """(PATCHES, EACH, EACH) from 40 pixels in 32 bits, one of which weighs ``dominance`` times as
    much as the others."""
    rng = np.random.default_rng(seed)
    derivative = rng.normal(size=(PATCHES, 40, EACH)).astype(np.float32)
    derivative[:, 0] *= np.float32(np.sqrt(dominance))
    squares = derivative.transpose(0, 2, 1) @ derivative
    every = np.full(PATCHES * EACH, 0.5)
    return patch_blocks(squares.astype(np.float64), every, np.zeros(PATCHES * EACH, bool))


def test_roots_give_the_inverse_and_its_products():
    blocks = blocks_of(1.0)
    inverse, roots = inverse_of_blocks(blocks)
    assert inverse == pytest.approx(np.linalg.inv(blocks), rel=1e-6, abs=1e-12)
    rows = np.random.default_rng(1).normal(size=(ROWS, PATCHES * EACH))
    wide = np.zeros((PATCHES * EACH,) * 2)
    for p in range(PATCHES):
        wide[p * EACH : (p + 1) * EACH, p * EACH : (p + 1) * EACH] = inverse[p]
    assert projected_squares(rows, roots) == pytest.approx(rows @ wide @ rows.T, rel=1e-9)


@pytest.mark.parametrize("dominance", [1e8, 1e12, 1e16])
def test_a_pixel_that_decides_nearly_all_does_not_end_the_fit(dominance: float):
    """The fit of a capture with an almost noise-free pixel ended with an error of its linear
    algebra."""
    inverse, roots = inverse_of_blocks(blocks_of(dominance))
    assert np.isfinite(roots).all()
    assert (np.einsum("pee->pe", inverse) > 0).all()
    assert (np.einsum("pee->pe", inverse) < 0.5**2 * 1.001).all(), "not above the prior's variance"
