"""The normal equations of BRDF coefficients and effect parameters, summed over pixels.

Coefficients of different channels and materials are coupled only through the parameters, and the
parameters of different patches only through the rest: the matrix is an arrow with two wings
(block_elimination.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, sparray

from ...linear_algebra import gram, transposed_product
from ...statistics.student_t import robust_weights
from .jacobian import Jacobian
from .model_fit import ModelFit

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

ROWS_PER_CHUNK = 16384  # of pixels: 25 MB
MAX_DENSE_COLUMNS = 48  # parameters; up to here a dense matrix is faster (measured)
DENSE_FILL = 0.2  # filled fraction above which a dense matrix is always faster (measured)


@dataclass(frozen=True)
class NormalEquations:
    """Sums over pixels without the prior, for M = m · 3 · k coefficients and p global parameters.

    blocks: (m, 3, k, k) of the coefficients of each material and channel. coupling: (M, p) between
    coefficients and parameters. own: (p, p) of the parameters. pull: (M,) and own_pull: (p,), the
    right-hand side. For P patches of e parameters each: local (P, e, e), local_coupling
    (M, P · e), local_own (p, P · e), local_pull (P, e).
    """

    blocks: Array
    coupling: Array
    own: Array
    pull: Array
    own_pull: Array
    local: Array
    local_coupling: Array
    local_own: Array
    local_pull: Array

    def damped(self, damping: float) -> NormalEquations:
        """With diagonals increased by a fraction of themselves (Marquardt 1963): a shorter step,
        which turns towards the steepest descent of the scaled parameters."""
        names = "blocks", "own", "local"
        return replace(self, **{name: _damped(getattr(self, name), damping) for name in names})

    @classmethod
    def of(cls, fit: ModelFit, jacobian: Jacobian, rows: NDArray[np.intp]) -> NormalEquations:
        """Summed over some of the pixels."""
        m, _, k = fit.model.brdfs.coefficients.shape
        p, count, e = jacobian.count, jacobian.patches, jacobian.local.shape[2]
        many = count * e
        blocks, pull = np.zeros((m, 3, k, k)), np.zeros((m, 3, k))
        coupling, local_coupling = np.zeros((m, 3, k, p)), np.zeros((m, 3, k, many))
        own, own_pull, local_own = np.zeros((p, p)), np.zeros(p), np.zeros((p, many))
        local, local_pull = np.zeros((count, e, e)), np.zeros(many)
        material = fit.model.pixels.material[rows]
        for index in range(m):
            for mine in _chunks(rows[material == index]):
                q = jacobian.q[mine]
                for c in range(3):
                    r = fit.residual[mine, c].astype(np.float32)
                    root = np.sqrt(robust_weights(r))
                    # sums in double precision: eigenvalues of a block differ by a factor of 10¹⁰
                    a = (q * (jacobian.rho[mine, c] * root)[:, None]).astype(np.float64)
                    r = r * root
                    blocks[index, c] += gram(a)
                    pull[index, c] += a.T @ r
                    x = _dense_if_faster(scaled(jacobian.matrix(mine, c), root)) if p else None
                    if x is not None:
                        own += _square(x)
                        coupling[index, c] += _coupling(x, a)
                        own_pull += x.T @ r
                    if many:
                        y = scaled(jacobian.local_matrix(mine, c), root)
                        local_coupling[index, c] += (y.T @ a).T
                        local_pull += y.T @ r
                        local += _by_patch(jacobian, mine, c, root)
                        if x is not None:
                            local_own += _dense(x.T @ y)
        size = m * 3 * k
        return cls(
            blocks, coupling.reshape(size, p), own, pull.reshape(size), own_pull, local,
            local_coupling.reshape(size, many), local_own, local_pull.reshape(count, e),
        )  # fmt: skip

    def plus(self, other: NormalEquations, times: float = 1.0) -> NormalEquations:
        """The sums with those of other pixels added; times −1: removed."""
        names = [f.name for f in fields(self)]
        return NormalEquations(**{n: getattr(self, n) + times * getattr(other, n) for n in names})


def scaled(x: csr_array, by: Array) -> csr_array:
    """Rows of x (r, p) multiplied by factors (r,)."""
    each = np.repeat(by, np.diff(x.indptr))
    return csr_array((x.data * each, x.indices, x.indptr), shape=x.shape)


def _chunks(rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """ROWS_PER_CHUNK rows at a time."""
    for start in range(0, len(rows), ROWS_PER_CHUNK):
        yield rows[start : start + ROWS_PER_CHUNK]


def _by_patch(jacobian: Jacobian, rows: NDArray[np.intp], channel: int, root: Array) -> Array:
    """(P, e, e) sums of products of the derivatives within each patch."""
    x = jacobian.local[rows, channel] * root[:, None]
    patch = np.maximum(jacobian.patch[rows], 0)
    e = x.shape[1]
    out = np.empty((jacobian.patches, e, e))
    for i in range(e):
        for j in range(e):
            out[:, i, j] = np.bincount(patch, x[:, i] * x[:, j], jacobian.patches)
    return out


def _dense_if_faster(x: csr_array) -> Array | csr_array:
    filled = x.nnz > DENSE_FILL * x.shape[0] * x.shape[1]
    return x.toarray() if x.shape[1] <= MAX_DENSE_COLUMNS or filled else x


def _square(x: Array | csr_array) -> Array:
    """(p, p) xᵀ x."""
    return _dense(x.T @ x) if isinstance(x, csr_array) else gram(x)


def _coupling(x: Array | csr_array, a: Array) -> Array:
    """(k, p) aᵀ x."""
    return (x.T @ a).T if isinstance(x, csr_array) else transposed_product(a, x)


def _dense(x: Array | sparray) -> Array:
    return np.asarray(x.toarray() if isinstance(x, sparray) else x)


def _damped(matrices: Array, damping: float) -> Array:
    """Symmetric matrices (..., k, k) with larger diagonals."""
    return matrices * (1 + damping * np.eye(matrices.shape[-1]))
