"""Groups of neighbouring nodes in a cubic lattice, and interpolation between them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ..concurrency.ordered_map import map_chunks

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

    def weights(
        self, points: NDArray[np.float64], pool: ThreadPoolExecutor | None = None
    ) -> csr_array:
        """(n, count) weights of the cells that interpolate at points (n, 3), without steps at
        borders: NEIGHBOUR_CELLS of a point are not 0, and their sum is 1."""
        tree = cKDTree(self.centre)
        neighbours = min(NEIGHBOUR_CELLS, self.count)

        def of_chunk(part: slice) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
            away, near = tree.query(points[part], k=neighbours)
            away, near = away.reshape(-1, neighbours), near.reshape(-1, neighbours)
            weight = np.exp(-0.5 * (away / (KERNEL_WIDTH * self.edge)) ** 2) + MIN_WEIGHT
            weight /= weight.sum(axis=1, keepdims=True)
            return near.astype(np.int32).ravel(), weight.astype(np.float32).ravel()

        parts = zip(*map_chunks(pool, of_chunk, len(points), CHUNK), strict=True)
        cell, weight = (np.concatenate(part) for part in parts)
        starts = np.arange(len(points) + 1) * neighbours
        return csr_array((weight, cell, starts), shape=(len(points), self.count))
