"""Normal equations of the coefficients and the photos' gains, in memory almost independent of the
number of photos.

The cells of a photo depend on the coefficients and on that photo's gain, never on another's. The
matrix of all equations is therefore an arrow matrix: a block for the coefficients, a diagonal for
the gains and the coupling between them. The prior of the gains' mean adds one product of a vector
with itself. The gains are eliminated first (Schur complement).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PhotoEquations:
    """The contribution of the cells of one photo to the normal equations.

    blocks: (3, k, k) for the coefficients of each channel; coupling: (3, k) between these and the
    photo's log gain; gain: the diagonal entry of the log gain; rhs: (3, k) and gain_rhs: the
    right-hand side.
    """

    blocks: NDArray[np.float32]
    coupling: NDArray[np.float32]
    gain: float
    rhs: NDArray[np.float32]
    gain_rhs: float

    @classmethod
    def of(
        cls, jacobian: Sequence[NDArray[np.float32]], residual: Array, weight: Array
    ) -> PhotoEquations:
        """From m cells of one photo. jacobian: 3 × (m, k); residual, weight: (m, 3)."""
        blocks, coupling, rhs = [], [], []
        gain = gain_rhs = 0.0
        for c, rows in enumerate(jacobian):
            w = weight[:, c].astype(np.float32)
            weighted = rows * w[:, None]
            blocks.append(weighted.T @ rows)
            coupling.append(weighted.sum(axis=0))
            rhs.append(weighted.T @ residual[:, c].astype(np.float32))
            gain += float(w.sum())
            gain_rhs += float(w @ residual[:, c])
        return cls(np.stack(blocks), np.stack(coupling), gain, np.stack(rhs), gain_rhs)


@dataclass(frozen=True)
class Arrow:
    """A symmetric positive definite matrix: an arrow matrix, and one product of a vector of the
    gains with itself.

    coefficients: (n, n) block; coupling: (n, p); the block of the gains is diag(gains) + common ·
    commonᵀ, both (p,).
    """

    coefficients: Array
    coupling: Array
    gains: Array
    common: Array

    def marginal(self) -> Array:
        """(n, n) precision of the coefficients with the gains integrated out (Schur complement)."""
        along, size = self._common_part
        return self._without_common + np.outer(along, along) / size

    def solve(self, rhs: Array) -> Array:
        """Solution x (n + p,) of matrix · x = rhs."""
        n = len(self.coefficients)
        x = np.linalg.solve(self.marginal(), rhs[:n] - self.coupling @ self._of_gains(rhs[n:]))
        return np.concatenate([x, self._of_gains(rhs[n:] - self.coupling.T @ x)])

    def without(self, place: int, one: PhotoEquations, prior: float) -> tuple[Array, Array]:
        """(precision (n, n), right-hand side (n,)) of the coefficients' step from the optimum to
        that without the photo at ``place``, with the equations ``one``: they are subtracted, and
        the precision of its log gain is ``prior``."""
        row, gain, own = self.coupling[:, place], self.gains[place], self.common[place]
        along, size = self._common_part
        rest = self._without_common + np.outer(row, row) / gain
        add_blocks(rest, one.blocks, -1.0)
        along = along - row * own / gain
        size = size - own**2 / gain + own**2 / prior
        rest += np.outer(along, along) / size
        pull = -one.rhs.ravel().astype(np.float64)
        return rest, pull - one.gain_rhs * own / (prior * size) * along

    def dense(self) -> Array:
        """(n + p, n + p) the full matrix."""
        n, p = self.coupling.shape
        out = np.zeros((n + p, n + p))
        out[:n, :n] = self.coefficients
        out[:n, n:] = self.coupling
        out[n:, :n] = self.coupling.T
        out[n:, n:] = np.diag(self.gains) + np.outer(self.common, self.common)
        return out

    def _of_gains(self, values: Array) -> Array:
        """(p,) inverse of the gains' block · values (Sherman–Morrison)."""
        own = self.common / self.gains
        _, size = self._common_part
        found: Array = values / self.gains - own * (float(own @ values) / size)
        return found

    @cached_property
    def _without_common(self) -> Array:
        """(n, n) the Schur complement for gains that are independent."""
        found: Array = self.coefficients - (self.coupling / self.gains) @ self.coupling.T
        return found

    @cached_property
    def _common_part(self) -> tuple[Array, float]:
        """((n,) v, s): integrating the gains out adds v · vᵀ / s, because of ``common``."""
        own = self.common / self.gains
        return self.coupling @ own, 1.0 + float(self.common @ own)


def add_blocks(matrix: Array, blocks: NDArray[np.floating], times: float = 1.0) -> None:
    """Add each channel's block (3, k, k), times a factor, to the diagonal of a matrix (3k, 3k), in
    place."""
    k = blocks.shape[1]
    for c, block in enumerate(blocks):
        part = slice(c * k, (c + 1) * k)
        matrix[part, part] += times * block.astype(np.float64)
