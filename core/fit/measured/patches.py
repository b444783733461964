"""Small patches of the surface, across photos: the samples of one share one rotation of the
normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

SAMPLES_PER_PATCH = 6.0  # of all photos together
MAX_PATCHES = 150_000
NEIGHBOUR_DISTANCE = 1.8  # patch sizes between centres of neighbours


@dataclass(frozen=True)
class Patches:
    """of: (n,) patch of each sample. count: number of patches. neighbours: (p, p) Laplacian of the
    graph of neighbouring patches. size: edge of a patch, scan units."""

    of: NDArray[np.int64]
    count: int
    neighbours: sparse.csr_matrix
    size: float

    @classmethod
    def of_points(cls, points: NDArray[np.float64]) -> Patches:
        """Cubes of one size around points (n, 3), scan units. The size is iterated until a cube
        holds about SAMPLES_PER_PATCH points, or there are MAX_PATCHES cubes."""
        low = points.min(axis=0)
        extent = float((points.max(axis=0) - low).max()) or 1.0
        goal = min(len(points) / SAMPLES_PER_PATCH, MAX_PATCHES)
        size = extent / 64
        for _ in range(6):  # their number grows with the inverse square of their size
            found = len(np.unique(_cubes(points, low, size)))
            if abs(np.log(found / max(goal, 1.0))) < 0.05:
                break
            size *= float(np.clip(np.sqrt(found / max(goal, 1.0)), 0.2, 5.0))
        _, of = np.unique(_cubes(points, low, size), return_inverse=True)
        of = of.ravel()
        count = int(of.max()) + 1
        inside = np.bincount(of, minlength=count)
        centre = np.stack([np.bincount(of, points[:, a], count) / inside for a in range(3)], axis=1)
        pairs = cKDTree(centre).query_pairs(NEIGHBOUR_DISTANCE * size, output_type="ndarray")
        touch = sparse.coo_matrix(
            (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count)
        ).tocsr()
        touch = touch + touch.T
        degree = np.asarray(touch.sum(axis=1)).ravel()
        return cls(of, count, (sparse.diags(degree) - touch).tocsr(), size)


def _cubes(points: NDArray[np.float64], low: NDArray[np.float64], size: float) -> NDArray[np.int64]:
    """(n,) number of the cube that holds each point."""
    at = np.floor((points - low) / size).astype(np.int64)
    return (at[:, 0] << 42) | (at[:, 1] << 21) | at[:, 2]
