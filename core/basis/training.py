"""Compute a basis from measured BRDFs that can be evaluated in given directions (Ono et al. 2019,
equations (1) and (2))."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from . import components, mapping
from .basis import Basis, Progress
from .grid import AngleGrid
from .residual_components import ComponentWeights, component_weights

BLOCK = 1 << 16  # directions evaluated at a time
# measured on the NBRDF set (run.py bench basis): finer grids gain less than a thousandth
DEFAULT_GRID = AngleGrid(n_h=84, n_d=46, n_p=30, knee=float(np.radians(0.7)))
DEFAULT_COUNT = 100  # more do not improve held-out materials; the paper's method uses the first 6


class MeasuredMaterials(Protocol):
    """Measured materials, three columns each."""

    @property
    def columns(self) -> int:
        """Number of columns: one per colour channel of each material."""
        ...

    def at(self, angles: Angles) -> NDArray[np.float32]:
        """ρ (columns, n) in 1/sr; negative where there is no measurement (then in all columns)."""
        ...


class Observations(MeasuredMaterials, Protocol):
    """Training columns: the materials of a database, with the cells of their Gram matrix."""

    def cell_blocks(self) -> Iterator[tuple[Angles, NDArray[np.float32], float]]:
        """Blocks of the cells of the Gram matrix, each cell once: their angles (n,), ρ (columns, n)
        in 1/sr, and the fraction of cells before the block."""
        ...


def train(
    observations: Observations,
    provenance: str,
    count: int = DEFAULT_COUNT,
    grid: AngleGrid = DEFAULT_GRID,
    progress: Progress = lambda stage, fraction: None,
    others: MeasuredMaterials | None = None,
) -> Basis:
    """Basis of ``count`` components, stored on ``grid``. others: measured materials that are not in
    the database; with them there are further components (residual_components.py). Works in blocks,
    so memory does not grow with the number of cells."""
    found = principal(observations, count, progress, others)
    nodes = Angles(*(a.ravel() for a in grid.nodes()))
    stacked = np.empty((2 + found.weights.shape[1], grid.size), np.float32)
    for start in range(0, grid.size, BLOCK):
        progress("nodes", start / grid.size)
        part = Angles(*(a[start : start + BLOCK] for a in nodes))
        stacked[:, start : start + BLOCK] = exact_rows(observations, found.weights, part, others)
    stacked = fill_unmeasured(stacked.reshape(-1, *grid.shape))
    n = observations.columns
    return Basis(
        grid=grid,
        mean=stacked[0],
        log_reference=stacked[1],
        components=stacked[2:],
        explained=found.explained,
        columns=n,
        provenance=provenance,
        training=found.coefficients[:n],
        others=None if others is None else found.coefficients[n:],
    )


def principal(
    observations: Observations,
    count: int,
    progress: Progress = lambda stage, fraction: None,
    others: MeasuredMaterials | None = None,
) -> ComponentWeights:
    """The components of equations (1) and (2), as weighted sums of the columns."""
    n = observations.columns

    def centred_blocks() -> Iterator[NDArray[np.float32]]:
        for angles, rho, fraction in observations.cell_blocks():
            progress("principal components", fraction)
            logs, mean, _ = _mapped(_with(others, rho, angles), angles, n)
            yield logs - mean

    gram = components.gram_matrix(centred_blocks(), n + (others.columns if others else 0))
    return component_weights(gram, n, count)


def exact_rows(
    observations: Observations,
    weights: NDArray[np.float64],
    angles: Angles,
    others: MeasuredMaterials | None = None,
) -> NDArray[np.float32]:
    """(2 + k, n): µ, ln(ref + ε) and the scaled components at directions (n,), directly from the
    observations; µ is NaN where there is no measurement. weights: (columns, k)."""
    rho = observations.at(angles)
    logs, mean, log_reference = _mapped(_with(others, rho, angles), angles, observations.columns)
    scaled = weights.T.astype(np.float32) @ (logs - mean)
    mean[rho[0] < 0] = np.nan
    return np.concatenate([mean[None], log_reference[None], scaled])


def _with(
    others: MeasuredMaterials | None, rho: NDArray[np.float32], angles: Angles
) -> NDArray[np.float32]:
    """ρ of the observations, then that of the other materials."""
    return rho if others is None else np.concatenate([rho, others.at(angles)])


def _mapped(
    rho: NDArray[np.float32], angles: Angles, own: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """(mapped observations (columns, n), their mean (n,), ln(ref + ε) (n,)); mean and reference
    are those of the first ``own`` columns."""
    weighted = np.maximum(rho, 0) * mapping.cos_map(angles).astype(np.float32)
    log_reference = np.log(np.median(weighted[:own], axis=0) + mapping.EPSILON)
    logs = np.log(weighted + mapping.EPSILON) - log_reference
    return logs, logs[:own].mean(axis=0), log_reference


def fill_unmeasured(stacked: NDArray[np.float32]) -> NDArray[np.float32]:
    """Nodes without measurement (NaN mean) take the values of the next smaller θd: interpolation
    near the horizon needs a value beyond it."""
    missing = np.isnan(stacked[0])
    for j in range(1, stacked.shape[2]):
        hole = missing[:, j]
        stacked[:, :, j][:, hole] = stacked[:, :, j - 1][:, hole]
    return np.nan_to_num(stacked, copy=False)
