"""Forward model: the expected value of every cell for given coefficients, and its derivatives by
them.

A clipped photo shows the radiance up to its white level. The samples of a cell whose normal is
wrong may be clipped or not, whatever the cell's own angles are. So a cell's prediction is clipped
as the photo is: at each quadrature normal, before the mean. Its clipped samples then count with the
white level, and no sample is left out for being bright or dark.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ...angles import Angles, cosines
from ...basis import Basis, mapping
from ...basis.log_table import LogTable
from .cells import AngleCells
from .normal_quadrature import quadrature_angles

MIN_COSINE = 0.01  # cos θi and cos θo are clamped to it
CORNERS = 8  # grid nodes that are interpolated at a direction


@dataclass(frozen=True)
class Prediction:
    """level: (m, 3) (ρ·cos θi)·cosMap/cos θi + ε of the blurred BRDF, the argument of the logarithm
    in Nielsen's mapping. spread: (m, 3) its relative variance over the possible normals of a cell.
    jacobian: 3 × (m, k), ∂ ln level / ∂c."""

    level: NDArray[np.float64]
    spread: NDArray[np.float64]
    jacobian: list[NDArray[np.float32]]


@dataclass(frozen=True)
class CellModel:
    """The forward model of a set of m cells in one basis, with j quadrature normals a cell.

    observed: (m, 3) like Prediction.level. scale: (m,) cosMap/cos θi of the cells. share: (j,)
    weights of the quadrature normals. factor: (m, j) what (exp(log) − ε) at a quadrature normal is
    multiplied by before it is added to ρ·cos θi. used: (u,) grid nodes that any cell needs.
    corners: (m·j, u) interpolates between them. pairs: the distinct pairs of a cell and a node.
    white: (m, j, 3) the level at which each quadrature normal's part of ρ·cos θi is clipped; None
    where no photo is.
    """

    basis: Basis
    cells: AngleCells
    observed: NDArray[np.float64]
    scale: NDArray[np.float64]
    share: NDArray[np.float64]
    factor: NDArray[np.float32]
    used: NDArray[np.intp]
    corners: csr_array
    pairs: CellNodes
    white: NDArray[np.float32] | None

    @classmethod
    def of(cls, cells: AngleCells, basis: Basis) -> CellModel:
        """Quadrature normals, grid nodes and weights of the cells."""
        seen, cos_i, cos_o, share = quadrature_angles(cells.angles, cells.normal_error)
        m, j = cos_i.shape
        index, weight = basis.grid.corners(Angles(*(a.ravel() for a in seen)))
        needed = np.zeros(basis.grid.size, bool)
        needed[index] = True
        number = np.cumsum(needed, dtype=np.int32) - np.int32(1)
        index, weight = number[index.T].ravel(), np.ascontiguousarray(weight.T).ravel()
        used = np.flatnonzero(needed)
        starts = np.arange(m * j + 1, dtype=np.int32) * CORNERS
        cos_map = np.clip(cos_i * np.maximum(cos_o, MIN_COSINE), 0.01, 1.0)
        lit = np.maximum(cos_i, 0.0) / cos_map
        cell_cos_i, cell_cos_o = cosines(*cells.angles)
        scale = np.clip(cell_cos_i * cell_cos_o, 0.01, 1.0) / np.maximum(cell_cos_i, MIN_COSINE)
        observed = np.maximum(cells.reflected, 0.0) * scale[:, None] + mapping.EPSILON
        return cls(
            basis=basis,
            cells=cells,
            observed=observed,
            scale=scale,
            share=share,
            factor=(share * lit).astype(np.float32),
            used=used,
            corners=csr_array((weight, index, starts), shape=(m * j, len(used))),
            pairs=CellNodes.of(index.reshape(m, -1), weight.reshape(m, -1)),
            white=_white_of_parts(cells.white, share),
        )

    def select(self, which: NDArray[np.bool_]) -> CellModel:
        """The model of some of the cells (m,)."""
        return CellModel(
            self.basis,
            self.cells.select(which),
            self.observed[which],
            self.scale[which],
            self.share,
            self.factor[which],
            self.used,
            self.corners[np.repeat(which, len(self.share))],
            self.pairs.select(which),
            None if self.white is None else self.white[which],
        )

    def predict(self, coefficients: NDArray[np.floating], jacobian: bool = True) -> Prediction:
        """Expected levels, and with ``jacobian`` their derivatives, for coefficients (3, k)."""
        table = LogTable.of(self.basis, coefficients).values[self.used]
        exponential = np.exp(np.clip(self.corners @ table, -12.0, 12.0))  # (m·j, 3)
        exponential = exponential.reshape(*self.factor.shape, 3)
        factor = self.factor[..., None]
        parts = factor * np.maximum(exponential - np.float32(mapping.EPSILON), 0)
        if self.white is not None:
            parts = np.minimum(parts, self.white)
            exponential = np.where(parts < self.white, exponential, 0)  # no derivative above white
        total = parts.sum(axis=1, dtype=np.float64)
        scale = self.scale[:, None]
        level = total * scale + mapping.EPSILON
        second = np.einsum("mjc,mjc,j->mc", parts, parts, 1 / self.share)
        wide = np.maximum(second - total**2, 0.0)
        spread = wide * (scale / level) ** 2
        if not jacobian:
            return Prediction(level, spread, [])
        each = self.pairs.sums @ (factor * exponential).reshape(-1, 3)
        components = self._components(coefficients.shape[1])
        shape = len(level), len(self.used)
        found = []
        for channel, to_log in enumerate((scale / level).astype(np.float32).T):
            data = np.ascontiguousarray(each[:, channel])
            matrix = csr_array((data, self.pairs.node, self.pairs.indptr), shape=shape)
            found.append((matrix @ components) * to_log[:, None])
        return Prediction(level, spread, found)

    def _components(self, k: int) -> NDArray[np.float32]:
        """(u, k) the first components of the basis at the used nodes, contiguous: a sparse product
        would copy others."""
        return np.ascontiguousarray(self.basis.nodes[self.used, 1 : 1 + k])


def _white_of_parts(
    white: NDArray[np.float64], share: NDArray[np.float64]
) -> NDArray[np.float32] | None:
    """(m, j, 3) white levels (m, 3) times the weights (j,) of the quadrature normals."""
    if not np.isfinite(white).any():
        return None
    return (share[None, :, None] * white[:, None]).astype(np.float32)


@dataclass(frozen=True)
class CellNodes:
    """The distinct pairs (q,) of one of m cells and a grid node that its quadrature normals need.

    sums: (q, m·j) adds up interpolation weights times values at the quadrature normals. indptr,
    node: the nodes of cell i are node[indptr[i]:indptr[i + 1]], ascending.
    """

    sums: csr_array
    indptr: NDArray[np.int32]
    node: NDArray[np.int32]

    @classmethod
    def of(cls, index: NDArray[np.int32], weight: NDArray[np.float32]) -> CellNodes:
        """From the nodes (m, j·8) of all cells, and their weights."""
        m, corners = index.shape
        order = np.argsort(index, axis=1)
        ordered = np.take_along_axis(index, order, axis=1)
        fresh = np.ones(index.shape, bool)
        fresh[:, 1:] = ordered[:, 1:] != ordered[:, :-1]
        starts = np.append(np.flatnonzero(fresh.ravel()), fresh.size).astype(np.int32)
        indptr = np.concatenate([[0], np.cumsum(fresh.sum(axis=1))]).astype(np.int32)
        normals = corners // CORNERS
        column = order // CORNERS + normals * np.arange(m)[:, None]
        data = np.take_along_axis(weight, order, axis=1).ravel()
        sums = csr_array(
            (data, column.ravel().astype(np.int32), starts), shape=(len(starts) - 1, m * normals)
        )
        return cls(sums, indptr, ordered[fresh])

    def select(self, which: NDArray[np.bool_]) -> CellNodes:
        """The pairs of some of the cells (m,)."""
        counts = np.diff(self.indptr)
        kept = np.repeat(which, counts)
        columns = np.repeat(which, self.sums.shape[1] // len(which))
        sums = self.sums[kept]
        number = np.cumsum(columns, dtype=np.int32) - np.int32(1)
        sums = csr_array(
            (sums.data, number[sums.indices], sums.indptr), shape=(sums.shape[0], columns.sum())
        )
        indptr = np.concatenate([[0], np.cumsum(counts[which])]).astype(np.int32)
        return CellNodes(sums, indptr, self.node[kept])
