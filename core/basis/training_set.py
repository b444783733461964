"""Precomputed training columns, so that a basis without some of the materials takes a second.

Centring removes the reference: X = C·L with L = ln(ρ·cosMap + ε) and C = I − 11ᵀ/n. The Gram matrix
of any subset of columns is therefore C·(L Lᵀ)·C of that subset's block of L Lᵀ, which is summed
over the MERL cells once. Mean and components at the nodes need only L at the nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..errors import UNREADABLE_NPZ, InputError, PatinaError
from ..files import atomic_path
from ..npz_file import open_npz
from . import mapping
from .basis import Basis, Progress
from .grid import AngleGrid
from .residual_components import centred, component_weights
from .training import BLOCK, DEFAULT_COUNT, DEFAULT_GRID, Observations, fill_unmeasured

FORMAT = 1
MAX_BYTES = 1 << 30  # unpacked; the 100 materials of the MERL database have 0.3 GB


@dataclass(frozen=True)
class TrainedBasis(Basis):
    """A basis with its training columns (``training`` is never None).

    materials: names; training column 3m + c is channel c of materials[m].
    """

    materials: tuple[str, ...] = ()


@dataclass(frozen=True)
class TrainingSet:
    """The data from which the basis of any subset of the materials is computed.

    materials: names, three columns (R, G, B) each. logs: (columns, grid.size) float32, ln(ρ·cosMap
    + ε) at the nodes. products: (columns, columns) float64, L Lᵀ summed over the MERL cells (L
    minus each cell's mean over the columns, which centring removes anyway).
    """

    materials: tuple[str, ...]
    grid: AngleGrid
    logs: NDArray[np.float32]
    products: NDArray[np.float64]
    provenance: str

    @staticmethod
    def compute(
        observations: Observations,
        materials: Sequence[str],
        provenance: str,
        grid: AngleGrid = DEFAULT_GRID,
        progress: Progress = lambda stage, fraction: None,
    ) -> TrainingSet:
        """From any training columns; each observation is evaluated twice, at the cells and at the
        nodes.

        Raises PatinaError where the columns are not three for each material.
        """
        if observations.columns != 3 * len(materials):
            raise PatinaError(
                f"{observations.columns} columns for {len(materials)} materials; expected 3 each"
            )
        products = np.zeros((observations.columns, observations.columns))
        for angles, rho, fraction in observations.cell_blocks():
            progress("training columns", fraction)
            logs = _logs(rho, angles)
            wide = (logs - logs.mean(axis=0)).astype(np.float64)
            products += wide @ wide.T
        nodes = Angles(*(a.ravel() for a in grid.nodes()))
        at_nodes = np.empty((observations.columns, grid.size), np.float32)
        for start in range(0, grid.size, BLOCK):
            progress("nodes", start / grid.size)
            part = Angles(*(a[start : start + BLOCK] for a in nodes))
            rho = observations.at(part)
            block = _logs(rho, part)
            block[:, rho[0] < 0] = np.nan
            at_nodes[:, start : start + BLOCK] = block
        filled = fill_unmeasured(at_nodes.reshape(-1, *grid.shape)).reshape(at_nodes.shape)
        return TrainingSet(tuple(materials), grid, filled, products, provenance)

    def basis(
        self,
        without: Sequence[str] = (),
        count: int = DEFAULT_COUNT,
        others: Sequence[str] = (),
    ) -> TrainedBasis:
        """The basis of all materials except those in ``without`` (all three channels of each),
        equations (1) and (2) of Ono et al. 2019. others: materials that are not in the database;
        with them there are further components (residual_components.py).

        Raises PatinaError for an unknown name, or too few columns for ``count`` components.
        """
        unknown = sorted({*without, *others} - set(self.materials))
        if unknown:
            raise PatinaError(f"unknown training material {unknown[0]!r}")
        kept = [name for name in self.materials if name not in {*without, *others}]
        columns = self._columns(kept)
        n = len(columns)
        if n <= count:
            raise PatinaError(f"{n} training columns; expected more than the {count} components")
        columns = np.concatenate([columns, self._columns(others)])
        gram = centred(self.products[np.ix_(columns, columns)], n)
        found = component_weights(gram, n, count)
        logs = self.logs if len(kept) == len(self.materials) else self.logs[columns]
        centre = logs[:n].mean(axis=0, dtype=np.float64).astype(np.float32)
        log_reference = np.empty(self.grid.size, np.float32)
        scaled = np.empty((found.weights.shape[1], self.grid.size), np.float32)
        w = found.weights.T.astype(np.float32)
        for start in range(0, self.grid.size, BLOCK):
            part = slice(start, start + BLOCK)
            # the mapping's reference: ln(median(ρ·cosMap) + ε)
            log_reference[part] = np.log(np.median(np.exp(logs[:n, part]), axis=0))
            scaled[:, part] = w @ (logs[:, part] - centre[part])
        note = f" Without {', '.join(sorted(without))}." if without else ""
        return TrainedBasis(
            grid=self.grid,
            mean=(centre - log_reference).reshape(self.grid.shape),
            log_reference=log_reference.reshape(self.grid.shape),
            components=scaled.reshape(-1, *self.grid.shape),
            explained=found.explained,
            columns=n,
            provenance=self.provenance + note,
            training=found.coefficients[:n],
            others=found.coefficients[n:] if others else None,
            materials=tuple(kept),
        )

    def _columns(self, names: Sequence[str]) -> NDArray[np.intp]:
        """The columns of these materials, three each."""
        place = {name: m for m, name in enumerate(self.materials)}
        return np.array([3 * place[name] + c for name in names for c in range(3)], np.intp)

    def save(self, path: Path) -> None:
        """Write the set (about 140 MB for MERL's 300 columns), atomically. Raises OSError."""
        with atomic_path(path) as partial, open(partial, "wb") as file:
            np.savez(
                file,
                format=np.int32(FORMAT),
                materials=np.array(self.materials),
                grid=np.array([*self.grid.shape, self.grid.knee]),
                logs=self.logs,
                products=self.products,
                provenance=np.array(self.provenance),
            )

    @staticmethod
    def load(path: Path) -> TrainingSet:
        """Read a set written by :meth:`save`. Raises InputError for anything else."""
        try:
            with open_npz(path, MAX_BYTES) as data:
                if int(data["format"]) != FORMAT:
                    raise InputError(f"format {int(data['format'])}; expected {FORMAT}", file=path)
                n_h, n_d, n_p, knee = (float(x) for x in data["grid"])
                grid = AngleGrid(int(n_h), int(n_d), int(n_p), knee)
                found = TrainingSet(
                    materials=tuple(str(n) for n in data["materials"]),
                    grid=grid,
                    logs=data["logs"],
                    products=data["products"],
                    provenance=str(data["provenance"]),
                )
        except UNREADABLE_NPZ as error:
            raise InputError(f"not a set of training columns ({error})", file=path) from error
        n = 3 * len(found.materials)
        if found.logs.shape != (n, grid.size) or found.products.shape != (n, n):
            raise InputError(f"the arrays do not fit {n} training columns", file=path)
        return found


def _logs(rho: NDArray[np.float32], angles: Angles) -> NDArray[np.float32]:
    """ln(ρ·cosMap + ε) (columns, n); negative ρ is set to 0."""
    weighted = np.maximum(rho, 0) * mapping.cos_map(angles).astype(np.float32)
    return np.log(weighted + np.float32(mapping.EPSILON))
