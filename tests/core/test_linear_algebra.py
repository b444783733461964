"""Products by SciPy's BLAS agree with NumPy's in double precision, for any shape."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core import linear_algebra

SIZES = st.integers(0, 30)


@settings(deadline=None, max_examples=60)
@given(SIZES, SIZES, SIZES, st.booleans(), st.booleans(), st.integers(0, 1000))
def test_products_agree_with_numpy(n, k, m, single, turned, seed):
    rng = np.random.default_rng(seed)
    kind = np.float32 if single else np.float64
    a, b, c = (rng.normal(size=s).astype(kind) for s in ((n, k), (k, m), (n, m)))
    if turned:  # not contiguous
        a, b, c = (np.asfortranarray(each) for each in (a, b, c))
    wide = a.astype(np.float64)
    found = [
        linear_algebra.gram(a), linear_algebra.row_gram(a), linear_algebra.product(a, b),
        linear_algebra.transposed_product(a, c),
    ]  # fmt: skip
    expected = [wide.T @ wide, wide @ wide.T, wide @ b, wide.T @ c]
    for one, other in zip(found, expected, strict=True):
        assert one.dtype == kind and one.shape == other.shape
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-4 if single else 1e-12)


def test_mixed_precision_gives_double():
    a, b = np.ones((3, 2), np.float32), np.ones((2, 4))
    assert linear_algebra.product(a, b).dtype == np.float64


@pytest.mark.parametrize("count", [0, 1, 20])
def test_positive_systems_are_solved(count):
    rng = np.random.default_rng(count)
    root = rng.normal(size=(count, count + 3))
    matrix, right = root @ root.T, rng.normal(size=(count, 4))
    kept = matrix.copy(), right.copy()
    found = linear_algebra.solve_positive(matrix, right)
    np.testing.assert_allclose(matrix @ found, right, atol=1e-8)
    assert (matrix == kept[0]).all() and (right == kept[1]).all()


def test_a_system_that_is_not_positive_is_solved_too():
    matrix = np.diag([1.0, -2.0])
    np.testing.assert_allclose(linear_algebra.solve_positive(matrix, np.eye(2)), np.diag([1, -0.5]))
