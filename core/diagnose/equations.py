"""The normal equations of coefficients and numbers.

Coefficients of different channels and materials touch one another only through the numbers, and the
numbers of different patches only through the rest: the matrix is an arrow with two wings, which are
eliminated block by block (Schur complements). So the BRDF cannot swallow an effect, nor an effect
the BRDF, without the other being offered the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, sparray

from .fitted import Fitted, weights
from .slopes import Slopes

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

CHUNK = 4096  # rows at a time
DENSE = 48  # numbers, up to which a full matrix is faster
FULL = 0.2  # of it is filled: a full matrix is faster however many they are


@dataclass(frozen=True)
class Change:
    """A step: of the coefficients (m, 3, k), of the numbers (p,), of the patches' (P · e,); and the
    covariance (p, p) of the numbers, the variances (P · e,) of the patches', where asked for."""

    coefficients: Array
    x: Vector
    local: Vector
    covariance: Array
    local_variance: Vector


@dataclass(frozen=True)
class Equations:
    """Sums over pixels, c for all coefficients, M = m · 3 · k. blocks: (m, 3, k, k) of each
    material's and channel's coefficients; coupling: (M, p) of these with the numbers; own: (p, p).
    pull: (M,); own_pull: (p,). Of the patches' numbers: local (P, e, e), local_coupling (M, P · e),
    local_own (p, P · e), local_pull (P, e). Without the prior."""

    blocks: Array
    coupling: Array
    own: Array
    pull: Array
    own_pull: Array
    local: Array
    local_coupling: Array
    local_own: Array
    local_pull: Array

    @classmethod
    def of(cls, fitted: Fitted, slopes: Slopes, rows: NDArray[np.intp]) -> Equations:
        """Of some pixels."""
        m, _, k = fitted.model.brdfs.coefficients.shape
        p, count, e = slopes.count, slopes.patches, slopes.local.shape[2]
        many = count * e
        blocks, pull = np.zeros((m, 3, k, k)), np.zeros((m, 3, k))
        coupling, local_coupling = np.zeros((m, 3, k, p)), np.zeros((m, 3, k, many))
        own, own_pull, local_own = np.zeros((p, p)), np.zeros(p), np.zeros((p, many))
        local, local_pull = np.zeros((count, e, e)), np.zeros(many)
        material = fitted.model.pixels.material[rows]
        for index in range(m):
            for mine in _chunks(rows[material == index]):
                q = slopes.q[mine]
                for c in range(3):
                    r = fitted.residual[mine, c].astype(np.float32)
                    root = np.sqrt(weights(r))
                    a = q * (slopes.rho[mine, c] * root)[:, None]
                    r = r * root
                    blocks[index, c] += a.T @ a
                    pull[index, c] += a.T @ r
                    x = _full_if_faster(scaled(slopes.matrix(mine, c), root)) if p else None
                    if x is not None:
                        own += _square(x)
                        coupling[index, c] += (x.T @ a).T
                        own_pull += x.T @ r
                    if many:
                        y = scaled(slopes.local_matrix(mine, c), root)
                        local_coupling[index, c] += (y.T @ a).T
                        local_pull += y.T @ r
                        local += _by_patch(slopes, mine, c, root)
                        if x is not None:
                            local_own += _full(x.T @ y)
        size = m * 3 * k
        return cls(
            blocks, coupling.reshape(size, p), own, pull.reshape(size), own_pull, local,
            local_coupling.reshape(size, many), local_own, local_pull.reshape(count, e),
        )  # fmt: skip

    def plus(self, other: Equations, times: float = 1.0) -> Equations:
        """With those of other pixels; times −1: without them."""
        names = [f.name for f in fields(self)]
        return Equations(**{n: getattr(self, n) + times * getattr(other, n) for n in names})

    def solved(self, fitted: Fitted, spread: bool = False) -> Change:
        """The prior included; numbers that a bound holds stay. spread: with the variances of the
        patches' numbers, which take longest."""
        if len(self.local):
            return self._solved_with_patches(fitted, spread)
        model = fitted.model
        variance = model.brdfs.variance
        m, _, k = model.brdfs.coefficients.shape
        usual = fitted.joined(lambda n: n.deviation)
        own = self.own + np.diag(1 / usual**2)
        right = self.own_pull - fitted.told / usual**2
        pull = self.pull - (model.brdfs.coefficients / variance).ravel()
        eliminated = []
        for index, block in enumerate(self.blocks.reshape(-1, k, k)):
            rows = slice(k * index, k * index + k)
            both = np.column_stack([self.coupling[rows], pull[rows]])
            found = np.linalg.solve(block + np.diag(1 / variance), both)
            eliminated.append(found)
            own = own - self.coupling[rows].T @ found[:, :-1]
            right = right - self.coupling[rows].T @ found[:, -1]
        free = np.flatnonzero(~_held(fitted, right))
        covariance = np.zeros_like(own)
        covariance[np.ix_(free, free)] = np.linalg.inv(own[np.ix_(free, free)])
        x = covariance @ right
        change = np.stack([found[:, -1] - found[:, :-1] @ x for found in eliminated])
        none = np.zeros(0)
        return Change(change.reshape(m, 3, k), x, none, covariance, none)

    def _solved_with_patches(self, fitted: Fitted, spread: bool) -> Change:
        """Patches eliminated first: what is left is full, but small."""
        model = fitted.model
        assert model.patchy is not None
        numbers, y = model.effects[model.patchy].numbers, model.x[model.patchy]
        m, _, k = model.brdfs.coefficients.shape
        size, p = len(self.pull), len(self.own)
        usual = fitted.joined(lambda n: n.deviation)
        full = np.zeros((size + p, size + p))
        for index, block in enumerate(self.blocks.reshape(-1, k, k)):
            rows = slice(k * index, k * index + k)
            full[rows, rows] = block + np.diag(1 / model.brdfs.variance)
        full[:size, size:], full[size:, :size] = self.coupling, self.coupling.T
        full[size:, size:] = self.own + np.diag(1 / usual**2)
        coefficients = (model.brdfs.coefficients / model.brdfs.variance).ravel()
        right = np.concatenate([self.pull - coefficients, self.own_pull - fitted.told / usual**2])
        side = np.concatenate([self.local_coupling, self.local_own])  # (M + p, P · e)
        pull = self.local_pull.ravel() - y / numbers.deviation**2
        held = ((y <= numbers.low) & (pull <= 0)) | ((y >= numbers.high) & (pull >= 0))
        side, pull = np.where(held, 0, side), np.where(held, 0, pull)
        inverse = np.linalg.inv(self._local(numbers.deviation, held))
        shape = (-1, *self.local.shape[:2])
        lean = np.einsum("spe,pef->spf", side.reshape(shape), inverse).reshape(len(side), -1)
        full -= lean @ side.T
        right = right - lean @ pull
        stuck = np.concatenate([np.zeros(size, bool), _held(fitted, right[size:])])
        free = np.flatnonzero(~stuck)
        known = np.concatenate([right[:, None], np.eye(size + p)[:, size:]], axis=1)
        solved = np.zeros((size + p, 1 + p))
        solved[free] = np.linalg.solve(full[np.ix_(free, free)], known[free])
        z, covariance = solved[:, 0], solved[size:, 1:]
        local = _blockwise(inverse, pull) - lean.T @ z
        variance = np.zeros(0)
        if spread:
            alone = np.einsum("pee->pe", inverse).ravel()
            through = np.linalg.solve(full[np.ix_(free, free)], lean[free])
            variance = np.where(held, 0, alone + np.einsum("sy,sy->y", lean[free], through))
        return Change(
            z[:size].reshape(m, 3, k), z[size:], np.where(held, 0, local), covariance, variance
        )

    def _local(self, deviation: Vector, held: NDArray[np.bool_]) -> Array:
        """(P, e, e) with the prior; what is held touches nothing."""
        count, e, _ = self.local.shape
        out = self.local.copy()
        out[:, range(e), range(e)] += (1 / deviation**2).reshape(count, e)
        stuck = held.reshape(count, e)
        out = np.where(stuck[:, :, None] | stuck[:, None, :], 0, out)
        out[:, range(e), range(e)] += stuck
        return out


def scaled(x: csr_array, by: Array) -> csr_array:
    """Rows of x (r, p) times by (r,)."""
    each = np.repeat(by, np.diff(x.indptr))
    return csr_array((x.data * each, x.indices, x.indptr), shape=x.shape)


def _chunks(rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """So many rows at a time as stay in a processor's cache."""
    for start in range(0, len(rows), CHUNK):
        yield rows[start : start + CHUNK]


def _by_patch(slopes: Slopes, rows: NDArray[np.intp], channel: int, root: Array) -> Array:
    """(P, e, e) sums of squares of the patches' own numbers."""
    x = slopes.local[rows, channel] * root[:, None]
    patch = np.maximum(slopes.patch[rows], 0)
    e = x.shape[1]
    out = np.empty((slopes.patches, e, e))
    for i in range(e):
        for j in range(e):
            out[:, i, j] = np.bincount(patch, x[:, i] * x[:, j], slopes.patches)
    return out


def _blockwise(inverse: Array, pull: Vector) -> Vector:
    """(P · e,) blocks (P, e, e) times a vector (P · e,)."""
    count, e, _ = inverse.shape
    return np.asarray(np.einsum("pef,pf->pe", inverse, pull.reshape(count, e)).ravel())


def _full_if_faster(x: csr_array) -> Array | csr_array:
    count = x.shape[1]
    return x.toarray() if count <= DENSE or x.nnz > FULL * x.shape[0] * count else x


def _square(x: Array | csr_array) -> Array:
    """(p, p) xᵀ x."""
    return _full(x.T @ x)


def _full(x: Array | sparray) -> Array:
    return np.asarray(x.toarray() if isinstance(x, sparray) else x)


def _held(fitted: Fitted, pull: Vector) -> NDArray[np.bool_]:
    """(p,) whether a bound holds a number."""
    low, high = fitted.joined(lambda n: n.low), fitted.joined(lambda n: n.high)
    x = fitted.numbers
    return np.asarray(((x <= low) & (pull <= 0)) | ((x >= high) & (pull >= 0)))
