"""What is typical around each vertex: scales gathered on the mesh's vertices and carried along its
edges into what no photo saw. Along the surface, so no seam of the texture shows, and nothing leaks
between islands that lie side by side in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import cg

from ..scan import Mesh
from .texels import Texels

Array = NDArray[np.float64]

STIFF = 0.25  # of what a well-seen vertex weighs: how much it follows its neighbours
HOME = 1e-4  # likewise: how much everything is drawn to 1
ENOUGH = 400.0  # inverse variance of a well-seen vertex (± 5 %); more counts as this
ROUNDS = 400


@dataclass
class VertexScales:
    """Sums at each vertex over a material's texels: total (v, c) of weight × value, weight (v,)."""

    total: Array
    weight: Array

    @classmethod
    def empty(cls, vertices: int, channels: int) -> VertexScales:
        """Nothing seen."""
        return cls(np.zeros((vertices, channels)), np.zeros(vertices))

    def add(
        self,
        mesh: Mesh,
        texels: Texels,
        rows: NDArray[np.intp],
        values: NDArray[np.floating],
        weight: NDArray[np.floating],
    ) -> None:
        """Values (n, c) with weights (n,) at texels ``rows`` (n,)."""
        v = len(self.weight)
        second, third = texels.second[rows].astype(np.float64), texels.third[rows]
        for k, share in enumerate((1.0 - second - third, second, third)):
            corner = mesh.faces[texels.face[rows], k]
            own = share * weight
            self.weight += np.bincount(corner, own, v)
            for c in range(values.shape[1]):
                self.total[:, c] += np.bincount(corner, own * values[:, c], v)

    def carried(
        self,
        mesh: Mesh,
        home: float,
        pull_home: float = HOME,
        trust: NDArray[np.floating] | None = None,
    ) -> Array:
        """(v, c) the smoothest values that agree with what was seen, drawn to ``home`` far away,
        the sooner the larger ``pull_home``. trust: (c,) factors of the weights, channel by channel.
        """
        v = len(self.weight)
        seen = self.weight > 0
        if not seen.any():
            return np.full(self.total.shape, home)
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
            own = np.minimum(self.weight * factor, ENOUGH) / ENOUGH
            diagonal = own + pull_home + STIFF * degree
            matrix = sparse.diags(diagonal) - STIFF * link
            near = sparse.diags(1.0 / diagonal)
            pull = own * mean[:, c] + pull_home * home
            start = np.where(seen, mean[:, c], home)
            out[:, c], _ = cg(matrix, pull, x0=start, rtol=1e-4, maxiter=ROUNDS, M=near)
        return out
