"""Groups of neighbouring nodes in a cubic lattice, and interpolation between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

NEIGHBOUR_CELLS = 6  # that a node's value is interpolated from
KERNEL_WIDTH = 0.6  # of the Gaussian weights of these, in edge lengths of a cell
MIN_WEIGHT = 1e-9  # so that a node far from all cells takes the value of the nearest ones
CHUNK = 1 << 17  # nodes at once, to limit memory


@dataclass(frozen=True)
class Cells:
    """Cells of n nodes. of: (n,) int32, the cell of each node; count: number of cells; centre:
    (count, 3) mean of its nodes, scan units; edge: length of a cell's edge, scan units."""

    of: NDArray[np.int32]
    count: int
    centre: NDArray[np.float64]
    edge: float

    @classmethod
    def group(cls, points: NDArray[np.float64], edge: float) -> Cells:
        """Group nodes at points (n, 3) by the cube of side ``edge`` that contains them."""
        key = np.floor((points - points.min(axis=0)) / edge).astype(np.int64)
        width = key.max(axis=0) + 1
        flat = (key[:, 0] * width[1] + key[:, 1]) * width[2] + key[:, 2]
        _, cell = np.unique(flat, return_inverse=True)
        count = int(cell.max()) + 1
        size = np.bincount(cell, minlength=count)
        sums = [np.bincount(cell, axis, count) for axis in points.T]
        return cls(cell.astype(np.int32), count, np.stack(sums, axis=1) / size[:, None], edge)

    def interpolated(
        self, values: NDArray[np.floating], points: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """(n, c) values (count, c) of the cells at points (n, 3), without steps at borders."""
        tree = cKDTree(self.centre)
        neighbours = min(NEIGHBOUR_CELLS, self.count)
        out = np.empty((len(points), values.shape[1]), np.float32)
        for begin in range(0, len(points), CHUNK):
            part = slice(begin, begin + CHUNK)
            away, near = tree.query(points[part], k=neighbours)
            away, near = away.reshape(-1, neighbours), near.reshape(-1, neighbours)
            weight = np.exp(-0.5 * (away / (KERNEL_WIDTH * self.edge)) ** 2) + MIN_WEIGHT
            weight /= weight.sum(axis=1, keepdims=True)
            out[part] = np.einsum("nk,nkc->nc", weight, values[near])
        return out
