"""The normal equations of coefficients and numbers, and what groups of pixels pull at numbers.

Coefficients of different channels and materials touch one another only through the numbers: the
matrix is an arrow, and the coefficients are eliminated block by block (Schur complement). So the
BRDF cannot swallow an effect, nor an effect the BRDF, without the other being offered the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from .fitted import Fitted, weights
from .slopes import Slopes

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

DENSE = 48  # numbers, up to which a full matrix is faster


@dataclass(frozen=True)
class Equations:
    """Sums over pixels. blocks: (m, 3, k, k) of each material's and channel's coefficients;
    coupling: (m, 3, k, p); own: (p, p); pull: (m, 3, k); own_pull: (p,). Without the prior."""

    blocks: Array
    coupling: Array
    own: Array
    pull: Array
    own_pull: Vector

    @classmethod
    def of(cls, fitted: Fitted, slopes: Slopes, rows: NDArray[np.intp]) -> Equations:
        """Of some pixels."""
        coefficients = fitted.model.brdfs.coefficients
        m, _, k = coefficients.shape
        p = slopes.count
        blocks, coupling = np.zeros((m, 3, k, k)), np.zeros((m, 3, k, p))
        own, pull, own_pull = np.zeros((p, p)), np.zeros((m, 3, k)), np.zeros(p)
        material = fitted.model.pixels.material[rows]
        for index in range(m):
            mine = rows[material == index]
            if not len(mine):
                continue
            q = slopes.q[mine]
            for c in range(3):
                r = fitted.residual[mine, c].astype(np.float32)
                root = np.sqrt(weights(r))
                a = q * (slopes.rho[mine, c] * root)[:, None]
                r = r * root
                blocks[index, c] = a.T @ a
                pull[index, c] = a.T @ r
                if p:
                    x = _scaled(slopes.matrix(mine, c), root)
                    own += _square(x)
                    coupling[index, c] = (x.T @ a).T
                    own_pull += x.T @ r
        return cls(blocks, coupling, own, pull, own_pull)

    def plus(self, other: Equations, times: float = 1.0) -> Equations:
        """With those of other pixels; times −1: without them."""
        return Equations(
            self.blocks + times * other.blocks,
            self.coupling + times * other.coupling,
            self.own + times * other.own,
            self.pull + times * other.pull,
            self.own_pull + times * other.own_pull,
        )

    def solved(self, fitted: Fitted) -> tuple[Array, Vector, Array]:
        """(change of the coefficients (m, 3, k), of the numbers (p,), covariance (p, p) of these),
        the prior included."""
        model = fitted.model
        variance = model.brdfs.variance
        m, _, k = model.brdfs.coefficients.shape
        own = self.own + np.diag(1 / model.usual**2)
        right = self.own_pull - fitted.numbers / model.usual**2
        pull = self.pull - model.brdfs.coefficients / variance
        eliminated = {}
        for index in range(m):
            for c in range(3):
                both = np.column_stack([self.coupling[index, c], pull[index, c]])
                found = np.linalg.solve(self.blocks[index, c] + np.diag(1 / variance), both)
                eliminated[index, c] = found
                own = own - self.coupling[index, c].T @ found[:, :-1]
                right = right - self.coupling[index, c].T @ found[:, -1]
        free = _free(fitted, right)
        covariance = np.zeros_like(own)
        covariance[np.ix_(free, free)] = np.linalg.inv(own[np.ix_(free, free)])
        x = covariance @ right
        change = np.zeros((m, 3, k))
        for (index, c), found in eliminated.items():
            change[index, c] = found[:, -1] - found[:, :-1] @ x
        return change, x, covariance


def scores(fitted: Fitted, slopes: Slopes, of: NDArray[np.intp], last: int) -> tuple[Array, Array]:
    """((b, last) what each group ``of`` pixels (n,) pulls at the last numbers, the part that all
    other unknowns could follow taken out; (last, last) inverse of these numbers' information)."""
    model, n = fitted.model, len(of)
    whole = Equations.of(fitted, slopes, np.arange(n))
    variance = model.brdfs.variance
    groups = int(of.max()) + 1
    own = whole.own + np.diag(1 / model.usual**2)
    pull = np.zeros((groups, slopes.count))
    for index in range(len(model.brdfs.coefficients)):
        mine = np.flatnonzero(model.pixels.material == index)
        one = (np.ones(len(mine), np.float32), of[mine], np.arange(len(mine) + 1))
        member = csr_array(one, shape=(len(mine), groups)).T
        for c in range(3):
            block = whole.blocks[index, c] + np.diag(1 / variance)
            projector = np.linalg.solve(block, whole.coupling[index, c])  # (k, p)
            own = own - whole.coupling[index, c].T @ projector
            r = fitted.residual[mine, c]
            wr = (weights(r) * r).astype(np.float32)
            x = slopes.matrix(mine, c)
            pull += (member @ _scaled(x, wr)).toarray()
            pull -= (member @ (slopes.q[mine] * (wr * slopes.rho[mine, c])[:, None])) @ projector
    first = slopes.count - last
    if first:
        others = np.linalg.solve(own[:first, :first], own[:first, first:])
        pull = pull[:, first:] - pull[:, :first] @ others
        own = own[first:, first:] - own[first:, :first] @ others
    return pull, np.linalg.inv(own)


def _scaled(x: csr_array, by: Array) -> csr_array:
    """Rows of x (r, p) times by (r,)."""
    each = np.repeat(by, np.diff(x.indptr))
    return csr_array((x.data * each, x.indices, x.indptr), shape=x.shape)


def _square(x: csr_array) -> Array:
    """(p, p) xᵀ x."""
    if x.shape[1] <= DENSE:
        full = x.toarray()
        return np.asarray(full.T @ full)
    return np.asarray((x.T @ x).toarray())


def _free(fitted: Fitted, pull: Vector) -> NDArray[np.intp]:
    """Places of the numbers that are not held by a bound."""
    bounds = [(e.numbers.low, e.numbers.high) for e in fitted.model.effects]
    low = np.concatenate([b[0] for b in bounds] + [np.zeros(0)])
    high = np.concatenate([b[1] for b in bounds] + [np.zeros(0)])
    x = fitted.numbers
    return np.flatnonzero(~(((x <= low) & (pull <= 0)) | ((x >= high) & (pull >= 0))))
