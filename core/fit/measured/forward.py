"""Forward model: the expected value of every cell for given coefficients, and its derivatives by
them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...angles import Angles, cosines
from ...basis import Basis, mapping
from ...basis.log_table import LogTable
from .cells import AngleCells
from .normal_quadrature import quadrature_angles

MIN_COSINE = 0.01  # cos θi and cos θo are clamped to it


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
    multiplied by before it is added to ρ·cos θi. index, weight: (m, j, 8) grid nodes and their
    interpolation weights. slot: (m·j·8,) index of each into the distinct (cell, node) pairs; those
    of cell i are node[indptr[i]:indptr[i + 1]].
    """

    basis: Basis
    cells: AngleCells
    observed: NDArray[np.float64]
    scale: NDArray[np.float64]
    share: NDArray[np.float64]
    factor: NDArray[np.float32]
    index: NDArray[np.int32]
    weight: NDArray[np.float32]
    slot: NDArray[np.int64]
    indptr: NDArray[np.int64]
    node: NDArray[np.int64]

    @classmethod
    def of(cls, cells: AngleCells, basis: Basis) -> CellModel:
        """Quadrature normals, grid nodes and weights of the cells."""
        seen, cos_i, cos_o, share = quadrature_angles(cells.angles, cells.normal_error)
        m, j = cos_i.shape
        index, weight = basis.grid.corners(Angles(*(a.ravel() for a in seen)))
        index = np.ascontiguousarray(index.T).reshape(m, j, 8)
        weight = np.ascontiguousarray(weight.T).reshape(m, j, 8)
        cos_map = np.clip(cos_i * np.maximum(cos_o, MIN_COSINE), 0.01, 1.0)
        lit = np.maximum(cos_i, 0.0) / cos_map
        slot, indptr, node = _distinct(index.reshape(m, -1))
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
            index=index,
            weight=weight,
            slot=slot,
            indptr=indptr,
            node=node,
        )

    def select(self, which: NDArray[np.bool_]) -> CellModel:
        """The model of some of the cells (m,)."""
        pairs = np.repeat(which, np.diff(self.indptr))
        fresh = np.cumsum(pairs) - 1
        slot = self.slot.reshape(self.index.shape)[which]
        return CellModel(
            self.basis,
            self.cells.select(which),
            self.observed[which],
            self.scale[which],
            self.share,
            self.factor[which],
            self.index[which],
            self.weight[which],
            fresh[slot].ravel(),
            np.concatenate([[0], np.cumsum(np.diff(self.indptr)[which])]),
            self.node[pairs],
        )

    def predict(self, coefficients: NDArray[np.floating], jacobian: bool = True) -> Prediction:
        """Expected levels, and with ``jacobian`` their derivatives, for coefficients (3, k)."""
        k = coefficients.shape[1]
        table = np.ascontiguousarray(LogTable.of(self.basis, coefficients).values.T)
        nodes = self.basis.leading_nodes(1 + k)  # contiguous: a sparse product would copy others
        m = len(self.cells)
        level, spread = np.empty((m, 3)), np.empty((m, 3))
        found: list[NDArray[np.float32]] = []
        for channel in range(3):
            logs = np.einsum("mjc,mjc->mj", table[channel][self.index], self.weight)
            exponential = np.exp(np.clip(logs, -12.0, 12.0))
            parts = self.factor * np.maximum(exponential - np.float32(mapping.EPSILON), 0)
            total = parts.sum(axis=1, dtype=np.float64)
            level[:, channel] = total * self.scale + mapping.EPSILON
            second = (parts.astype(np.float64) ** 2 / self.share).sum(axis=1)
            wide = np.maximum(second - total**2, 0.0)
            spread[:, channel] = wide * (self.scale / level[:, channel]) ** 2
            if jacobian:
                each = (self.factor * exponential)[..., None] * self.weight
                data = np.bincount(self.slot, each.ravel(), len(self.node))
                matrix = sparse.csr_matrix(
                    (data.astype(np.float32), self.node, self.indptr),
                    shape=(m, self.basis.grid.size),
                )
                derivative = (matrix @ nodes)[:, 1:]
                found.append(
                    derivative * (self.scale / level[:, channel]).astype(np.float32)[:, None]
                )
        return Prediction(level, spread, found)


def _distinct(
    index: NDArray[np.integer],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """(slot (m·j,), indptr (m + 1,), node): the distinct nodes in each row of index (m, j), sorted.
    Those of row i are node[indptr[i]:indptr[i + 1]]; slot is the position of each entry in node."""
    order = np.argsort(index, axis=1)
    ordered = np.take_along_axis(index, order, axis=1)
    fresh = np.ones(index.shape, bool)
    fresh[:, 1:] = ordered[:, 1:] != ordered[:, :-1]
    place = np.cumsum(fresh.ravel(), dtype=np.int64).reshape(index.shape) - 1
    slot = np.empty_like(place)
    np.put_along_axis(slot, order, place, axis=1)
    indptr = np.concatenate([[0], np.cumsum(fresh.sum(axis=1, dtype=np.int64))])
    return slot.ravel(), indptr, ordered[fresh].astype(np.int64)
