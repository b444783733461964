"""A BRDF in a basis as one table of logarithms at the grid's nodes.

Interpolation is linear in the logarithm, so ln(ρ·cosMap + ε) = centre + Q̂ c can be summed over the
components at the nodes first. A direction then needs eight nodes instead of eight rows of Q.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..linear_algebra import product
from . import mapping
from .basis import Basis
from .grid import AngleGrid

CHUNK = 1 << 17


@dataclass(frozen=True)
class LogTable:
    """values: (grid.size, c) float32, ln(ρ·cosMap + ε) at the nodes for c channels."""

    grid: AngleGrid
    values: NDArray[np.float32]

    @staticmethod
    def of(basis: Basis, coefficients: NDArray[np.floating]) -> LogTable:
        """The table of c channels with coefficients (c, k): x = Q c + µ, equation (3) of Ono et al.
        2019, at the nodes."""
        c = np.asarray(coefficients, np.float32)
        weights = np.concatenate([np.ones((len(c), 1), np.float32), c], axis=1)
        return LogTable(basis.grid, product(basis.leading_nodes(weights.shape[1]), weights.T))

    def grey(self) -> LogTable:
        """A table of one channel: the mean of ρ·cosMap + ε over the channels."""
        top = self.values.max(axis=1, keepdims=True)
        mean = np.exp(self.values - top).mean(axis=1, keepdims=True)
        return LogTable(self.grid, (top + np.log(mean)).astype(np.float32))

    def logs(self, angles: Angles) -> NDArray[np.float32]:
        """(n, c) ln(ρ·cosMap + ε) at n directions."""
        return self.grid.interpolate(self.values, angles)

    def evaluate(self, angles: Angles) -> NDArray[np.float32]:
        """ρ (n, c) in 1/sr at n directions."""
        n = len(angles.theta_h)
        out = np.empty((n, self.values.shape[1]), np.float32)
        for start in range(0, n, CHUNK):
            part = Angles(*(a[start : start + CHUNK] for a in angles))
            out[start : start + CHUNK] = mapping.unlog_weighted(
                self.logs(part), mapping.cos_map(part)
            )
        return out
