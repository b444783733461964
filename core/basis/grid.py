"""Nodes in angle space on which a basis is stored, and trilinear interpolation between them.

θh is spaced logarithmically, s = ln(1 + θh/a) / ln(1 + 90°/a): a lobe of 1° gets as many nodes as
one of 30°. θd is uniform from 0° to 90° inclusive; φd is uniform and periodic on [0°, 180°). The
OSL shader reads the same nodes with the same weights (appearance/osl_atlas.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..angles import Angles

HALF_PI = np.pi / 2


@dataclass(frozen=True)
class AngleGrid:
    """n_h × n_d × n_p nodes; knee: the constant a of the θh spacing, radians."""

    n_h: int
    n_d: int
    n_p: int
    knee: float

    @property
    def shape(self) -> tuple[int, int, int]:
        """(n_h, n_d, n_p)."""
        return self.n_h, self.n_d, self.n_p

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.n_h * self.n_d * self.n_p

    def nodes(self) -> Angles:
        """Angles of all nodes, each (n_h, n_d, n_p) float64, radians."""
        s = np.linspace(0.0, 1.0, self.n_h)
        theta_h = self.knee * np.expm1(s * np.log1p(HALF_PI / self.knee))
        theta_d = np.linspace(0.0, HALF_PI, self.n_d)
        phi_d = np.arange(self.n_p) * np.pi / self.n_p
        return Angles(*np.meshgrid(theta_h, theta_d, phi_d, indexing="ij"))

    def corners(self, angles: Angles) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Flat node indices (8, n) and weights (8, n) that interpolate at n directions."""
        th, td, pd = (np.asarray(a, np.float64).ravel() for a in angles)
        u_h = np.log1p(np.clip(th, 0, HALF_PI) / self.knee) / np.log1p(HALF_PI / self.knee)
        u_h = u_h * (self.n_h - 1)
        u_d = np.clip(td / HALF_PI, 0, 1) * (self.n_d - 1)
        u_p = np.mod(pd / np.pi, 1.0) * self.n_p
        h0 = np.minimum(u_h.astype(np.int32), self.n_h - 2)
        d0 = np.minimum(u_d.astype(np.int32), self.n_d - 2)
        p0 = np.minimum(u_p.astype(np.int32), self.n_p - 1)
        f_h, f_d, f_p = u_h - h0, u_d - d0, u_p - p0
        p1 = (p0 + 1) % self.n_p
        index = np.empty((8, th.size), np.int32)
        weight = np.empty((8, th.size), np.float32)
        for corner in range(8):
            i, j, k = corner >> 2 & 1, corner >> 1 & 1, corner & 1
            index[corner] = ((h0 + i) * self.n_d + d0 + j) * self.n_p + (p1 if k else p0)
            weight[corner] = (
                (f_h if i else 1 - f_h) * (f_d if j else 1 - f_d) * (f_p if k else 1 - f_p)
            )
        return index, weight

    def interpolate(self, node_values: NDArray[np.float32], angles: Angles) -> NDArray[np.float32]:
        """Values (n, c) at n directions from node_values (size, c)."""
        index, weight = self.corners(angles)
        count = index.shape[1]
        starts = np.arange(count + 1, dtype=np.int32) * len(index)
        # a sparse product reads each node once and needs no array beside the result
        matrix = csr_array((weight.T.ravel(), index.T.ravel(), starts), shape=(count, self.size))
        return np.asarray(matrix @ node_values, np.float32)
