"""Normal equations of coefficients and photos' gains, in memory that hardly grows with the photos.

A photo's cells speak of the coefficients and of their own photo's gain, never of another's. So the
matrix of all equations is an arrow: a block of coefficients, a diagonal of gains, and what couples
the two. Gains are eliminated first (Schur complement); nothing is kept photo by photo.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PhotoEquations:
    """What the cells of one photo add. blocks: (3, k, k) of each channel's coefficients; coupling:
    (3, k) of these and the photo's log gain; gain: the gain's own. pull: (3, k) and gain_pull, the
    right-hand side."""

    blocks: NDArray[np.float32]
    coupling: NDArray[np.float32]
    gain: float
    pull: NDArray[np.float32]
    gain_pull: float

    @classmethod
    def of(
        cls, slopes: Sequence[NDArray[np.float32]], residual: Array, weight: Array
    ) -> PhotoEquations:
        """slopes: 3 of (m, k); residual, weight: (m, 3); m cells of one photo."""
        blocks, coupling, pull = [], [], []
        gain = gain_pull = 0.0
        for c, rows in enumerate(slopes):
            w = weight[:, c].astype(np.float32)
            weighted = rows * w[:, None]
            blocks.append(weighted.T @ rows)
            coupling.append(weighted.sum(axis=0))
            pull.append(weighted.T @ residual[:, c].astype(np.float32))
            gain += float(w.sum())
            gain_pull += float(w @ residual[:, c])
        return cls(np.stack(blocks), np.stack(coupling), gain, np.stack(pull), gain_pull)


@dataclass(frozen=True)
class Arrow:
    """A symmetric positive definite matrix. coefficients: (n, n). coupling: (n, p). gains: (p,),
    its diagonal."""

    coefficients: Array
    coupling: Array
    gains: Array

    def marginal(self) -> Array:
        """(n, n) precision of the coefficients, the gains integrated out."""
        found: Array = self.coefficients - (self.coupling / self.gains) @ self.coupling.T
        return found

    def solve(self, pull: Array) -> Array:
        """x (n + p,) of matrix · x = pull."""
        n = len(self.coefficients)
        own = pull[n:] / self.gains
        x = np.linalg.solve(self.marginal(), pull[:n] - self.coupling @ own)
        return np.concatenate([x, own - (self.coupling.T @ x) / self.gains])

    def dense(self) -> Array:
        """(n + p, n + p) the whole matrix."""
        n, p = self.coupling.shape
        out = np.zeros((n + p, n + p))
        out[:n, :n] = self.coefficients
        out[:n, n:] = self.coupling
        out[n:, :n] = self.coupling.T
        out[range(n, n + p), range(n, n + p)] = self.gains
        return out


def add_blocks(matrix: Array, blocks: NDArray[np.floating], times: float = 1.0) -> None:
    """Each channel's block (3, k, k) onto the diagonal of a matrix (3k, 3k), in place."""
    k = blocks.shape[1]
    for c, block in enumerate(blocks):
        part = slice(c * k, (c + 1) * k)
        matrix[part, part] += times * block.astype(np.float64)
