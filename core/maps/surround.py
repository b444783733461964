"""Smooth values on the vertices of the mesh, interpolated along its edges into areas that no photo
shows. Along the surface there are no texture seams, and adjacent UV islands do not mix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import cg

from ..scan import Mesh
from .texels import Texels

Array = NDArray[np.float64]

# weights relative to the data term of a well-measured vertex:
SMOOTHNESS = 0.25  # of the difference from each neighbour
DEFAULT_PULL = 1e-4  # of the difference from the default value
MAX_WEIGHT = 400.0  # inverse variance of a well-measured vertex (± 5 %); larger ones are clipped
MAX_ITERATIONS = 400  # of the conjugate gradient solver


@dataclass
class VertexScales:
    """Sums over the texels of a material at each vertex. total: (v, c) weight × value; weight:
    (v,)."""

    total: Array
    weight: Array

    @classmethod
    def empty(cls, vertices: int, channels: int) -> VertexScales:
        """Zero sums."""
        return cls(np.zeros((vertices, channels)), np.zeros(vertices))

    def add(
        self,
        mesh: Mesh,
        texels: Texels,
        rows: NDArray[np.intp],
        values: NDArray[np.floating],
        weight: NDArray[np.floating],
    ) -> None:
        """Add values (n, c) with weights (n,) of the texels ``rows`` (n,)."""
        v = len(self.weight)
        second, third = texels.second[rows].astype(np.float64), texels.third[rows]
        for k, share in enumerate((1.0 - second - third, second, third)):
            corner = mesh.faces[texels.face[rows], k]
            own = share * weight
            self.weight += np.bincount(corner, own, v)
            for c in range(values.shape[1]):
                self.total[:, c] += np.bincount(corner, own * values[:, c], v)

    def interpolated(
        self,
        mesh: Mesh,
        default: float,
        default_pull: float = DEFAULT_PULL,
        trust: NDArray[np.floating] | None = None,
    ) -> Array:
        """(v, c) smooth values on all vertices: the minimum of a quadratic energy with a data term,
        a smoothness term over the edges, and a pull towards the value ``default``. A larger
        ``default_pull`` shortens the distance at which the default is reached. trust: (c,) factors
        of the weights of each channel."""
        v = len(self.weight)
        seen = self.weight > 0
        if not seen.any():
            return np.full(self.total.shape, default)
        mean = self.total / np.maximum(self.weight, 1e-30)[:, None]
        edges = np.concatenate(
            [mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]
        )
        link = sparse.coo_matrix((np.ones(len(edges)), edges.T), shape=(v, v)).tocsr()
        link = link + link.T
        link.data[:] = 1.0
        degree = np.asarray(link.sum(axis=1)).ravel()
        out = np.empty_like(self.total)
        for c in range(self.total.shape[1]):
            factor = 1.0 if trust is None else float(trust[c])
            own = np.minimum(self.weight * factor, MAX_WEIGHT) / MAX_WEIGHT
            diagonal = own + default_pull + SMOOTHNESS * degree
            matrix = sparse.diags(diagonal) - SMOOTHNESS * link
            near = sparse.diags(1.0 / diagonal)
            pull = own * mean[:, c] + default_pull * default
            start = np.where(seen, mean[:, c], default)
            out[:, c], _ = cg(matrix, pull, x0=start, rtol=1e-4, maxiter=MAX_ITERATIONS, M=near)
        return out
