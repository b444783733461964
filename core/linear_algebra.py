"""Products and solutions of large matrices by SciPy's BLAS.

The OpenBLAS in NumPy's wheels is older than SciPy's. Where it does not know the processor, it uses
instructions that every processor has, and takes five to ten times as long (measured).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

Array = NDArray[np.floating]


def gram(a: Array) -> Array:
    """(k, k) aᵀ a of a matrix (n, k)."""
    if not a.size:
        return a.T @ a
    found = _routine("syrk", a)(1.0, a.T)
    return _symmetric(found)


def row_gram(a: Array) -> Array:
    """(n, n) a aᵀ of a matrix (n, k)."""
    if not a.size:
        return a @ a.T
    found = _routine("syrk", a)(1.0, a.T, trans=1)
    return _symmetric(found)


def product(a: Array, b: Array) -> Array:
    """(n, m) a b of matrices (n, k) and (k, m)."""
    if not a.size or not b.size:
        return a @ b
    return np.asarray(_routine("gemm", a, b)(1.0, b.T, a.T).T)


def transposed_product(a: Array, b: Array) -> Array:
    """(k, m) aᵀ b of matrices (n, k) and (n, m)."""
    if not a.size or not b.size:
        return a.T @ b
    return np.asarray(_routine("gemm", a, b)(1.0, b.T, a.T, trans_b=1).T)


def solve_positive(matrix: Array, right: Array) -> Array:
    """(n, m) matrix⁻¹ right, for a symmetric positive definite matrix (n, n) and right (n, m). One
    that rounding has made indefinite is solved by elimination. Raises LinAlgError where it is
    singular."""
    if not matrix.size or not right.size:
        return np.linalg.solve(matrix, right)
    _, found, failed = lapack.dposv(matrix, right)
    return np.linalg.solve(matrix, right) if failed else np.asarray(found)


def _routine(name: str, *matrices: Array) -> Any:
    """The routine of the precision of all matrices."""
    kind = np.result_type(*matrices)
    return getattr(blas, ("s" if kind == np.float32 else "d") + name)


def _symmetric(upper: Array) -> Array:
    """A matrix of which BLAS has computed the upper triangle."""
    found = np.asarray(upper)
    low = np.tril_indices(len(found), -1)
    found[low] = found.T[low]
    return found
