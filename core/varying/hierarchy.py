"""The hierarchical prior: parameters of nodes as a sum of fields from coarse to fine.

    θ(node) = Σ_l δ_l(cell of the node at level l),   δ_l ~ N(0, Σ_l)

Each level has cells of half the size of those before. A node that one photo shows differs from its
surroundings only as far as Σ_l, the covariance over the surface, allows; one that many photos show
follows them. Σ_l, with the correlations of the parameters, is estimated from the photos (empirical
Bayes by expectation–maximisation, Efron and Morris 1973).

The levels are estimated in turn, from coarse to fine; then once more for the colour. Where
a single photo shows the surface, the first estimate of a coarse level is too small, because all
finer variation still counts as noise. The other parameters are estimated once: they explain errors
of the model too, and held-out photos are predicted worse the further they follow these.

At each level one Gauss–Newton step is made for all cells at once, on the logarithm of the radiance,
with Student-t errors. Their variance is that of the photos and the model, the same everywhere, and
that of the mesh's normals: where light or view are grazing, or in a highlight, a small error of the
normal changes the radiance much. Errors are alike in all channels for the most part, so that in the
second estimate of the colour the differences of the channels weigh more. The pixels of one cell in
one photo have errors in common (of the normals, of the material, of the place in the photo), so
that together they count as one. A clipped pixel says that the radiance is at least the photo's
white (a censored observation, Tobin 1958).
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from ..concurrency.ordered_map import map_chunks
from ..statistics.student_t import weights_of_squares
from .cells import Cells
from .node_model import COUNT, LIMITS, TILT, NodeModel
from .observations import Observations
from .radiance_error import MAX_ERROR, RadianceError, log_residuals, near_black, steepness

Array = NDArray[np.floating]

PIXELS_PER_CELL = 20.0  # nodes of a cell whose observations are used: four times those that count
COARSEST = 24  # cells along the object's longest side at the first level
PHOTO_WEIGHT = 1.5
"""Of each channel of a photo in a cell. More than 1, as the errors at a coarse level are partly
what finer levels explain. Held-out photos of five real captures and the simulated object were
predicted with 1 to 11 % smaller typical errors than with a weight of 0.5 of each pixel, up to five
in a cell; a weight of 2 was worse for the bronze."""
CHANNEL_SHARE = 0.7
"""The same in the variances: three channels count as two, because their errors are alike."""
EM_ROUNDS = 20
EM_CELLS = 1_000  # that Σ is estimated from: its standard deviations are then known to 2 %
FIRST_DEVIATION = np.array([0.4, 0.4, 0.4, 0.4, 0.3, 0.16, 0.16, 0.16, 0.2, 0.2])
"""Standard deviations that the estimate of the first level's Σ starts from; each next level starts
from LEVEL_RATIO times those of the one before."""
LEVEL_RATIO = 0.7
MIN_DEVIATION = 1e-3
MODEL_ERROR_RATIO = 1.5
"""Of the errors of parameters to the standard errors of the linear model, which does not know the
errors that all pixels of a photo have in common. Measured on simulated spheres with materials that
are not in the basis (tests/core/test_varying_job.py): 90 % intervals hold with it."""
INTERPOLATION_ERROR = 0.015  # standard error of parameters from interpolation between cells
MAX_TILT = 0.04
"""Standard deviation of the tilt, radians, of cells as large as the edges of the mesh and smaller:
the normals of meshes from stereo are off by 3 to 4 degrees at the 95th percentile. In cells n times
as large it is n times smaller: a tilt over a long way would move the surface, whose position is
well known."""
MAX_STEP = np.array([1, 1, 1, 1, 0.5, 0.15, 0.15, 0.15, 0.5, 0.5])  # of one level
CHUNK = 1 << 17  # observations at once, to limit memory


@dataclass(frozen=True)
class NodeFields:
    """Parameters (n, 10) of n nodes and their variances (n, 10), both float32; the variances are 0
    before the finest level. deviation: (levels, 10) standard deviations of each level's Σ; error:
    of the logarithm of the radiance that remains."""

    parameters: NDArray[np.float32]
    variance: NDArray[np.float32]
    deviation: Array
    error: float


def edges_of_levels(points: NDArray[np.float64], spacing: float) -> list[float]:
    """Edge lengths of the cells of all levels, down to about the spacing of the nodes."""
    size = float(np.ptp(points, axis=0).max()) / COARSEST
    count = max(1, 1 + round(float(np.log2(max(size / spacing, 1.0)))))
    return [size / 2**level for level in range(count)]


def solve(
    model: NodeModel,
    seen: Observations,
    points: NDArray[np.float64],
    normals: NDArray[np.floating],
    edges: list[float],
    free: NDArray[np.bool_],
    mesh_edge: float,
    normal_error: float,
    pool: ThreadPoolExecutor | None = None,
) -> Iterator[tuple[float, NodeFields]]:
    """Estimate the parameters of n nodes; yields (fraction done, fields so far) after each level.

    seen: observations of nodes 0 … n − 1. points, normals: (n, 3), scan frame. edges: of the cells
    of each level, scan units. free: (10,) parameters that may differ from 0. mesh_edge: mean length
    of an edge of the mesh, scan units. normal_error: standard deviation, radians along each
    tangent, of the error of the normals that no tilt corrects. pool: for the work; the result is
    the same, to the last bit, with any number of threads.
    """
    normal = np.asarray(normals, np.float32)
    theta = np.zeros((len(points), COUNT), np.float32)
    which = np.flatnonzero(free)
    black = near_black(seen)
    noise = RadianceError.of(model, seen, normal, theta, black, normal_error)
    levels = [
        _Level.of(points, edge, FIRST_DEVIATION[which] * LEVEL_RATIO**number, pool)
        for number, edge in enumerate(edges)
    ]
    colour = np.flatnonzero(np.isin(which, model.colour))
    every = np.arange(len(which))
    rounds = [(number, every) for number in range(len(levels))]
    rounds += [(number, colour) for number in range(len(levels))]
    for done, (number, some) in enumerate(rounds, 1):
        level, own = levels[number], which[some]
        part = level.subset(seen)
        used = noise if done > len(levels) else noise.without_hue()
        equations = _Equations.of(model, part, normal, theta, level.cells, own, black, used, pool)
        tilt = MAX_TILT * min(1.0, mesh_edge / level.cells.edge)
        before = level.change[:, some]
        found, spread, sigma = equations.around(before).posterior(
            level.sigma[np.ix_(some, some)], tilt, pool
        )
        found = np.clip(found, -MAX_STEP[own], MAX_STEP[own])
        theta[:, own] += level.at_nodes(found - before)
        np.clip(theta, -LIMITS, LIMITS, out=theta)
        levels[number] = level.with_estimate(some, found, spread, sigma, noise.error)
        noise = RadianceError.of(model, seen, normal, theta, black, normal_error)
        variance, deviation = np.zeros_like(theta), np.zeros((len(levels), COUNT))
        if done == len(rounds):
            variance[:, which] = _summed_variance(levels, noise.error)
        deviation[:, which] = [np.sqrt(np.diag(one.sigma)) for one in levels]
        yield done / len(rounds), NodeFields(theta, variance, deviation, noise.error)


@dataclass(frozen=True)
class _Level:
    """One field of the sum. change: (c, k) its values in the cells; spread: (c, k) their variances;
    sigma: (k, k) covariance over the surface; error: (k,) of the logarithm of the radiance that
    spread assumes. weights: (n, c) of the cells at the nodes."""

    cells: Cells
    weights: csr_array
    change: Array
    spread: Array
    sigma: Array
    error: Array

    @classmethod
    def of(
        cls,
        points: NDArray[np.float64],
        edge: float,
        deviation: Array,
        pool: ThreadPoolExecutor | None,
    ) -> _Level:
        """A field that is 0, with a first guess of its standard deviations (k,)."""
        cells = Cells.group(points, edge)
        weights, empty = cells.weights(points, pool), np.zeros((cells.count, len(deviation)))
        error = np.full(len(deviation), MAX_ERROR)
        return cls(cells, weights, empty, empty, np.diag(deviation**2), error)

    def at_nodes(self, values: Array) -> NDArray[np.float32]:
        """(n, k) values (c, k) of the cells at the nodes, without steps at borders."""
        return np.asarray(self.weights @ values.astype(np.float32), np.float32)

    def with_estimate(
        self, some: NDArray[np.intp], change: Array, spread: Array, sigma: Array, error: float
    ) -> _Level:
        """The field with new values of the parameters ``some``."""
        new = [a.copy() for a in (self.change, self.spread, self.sigma, self.error)]
        new[0][:, some], new[1][:, some] = change, spread
        new[2][np.ix_(some, some)], new[3][some] = sigma, error
        return _Level(self.cells, self.weights, *new)

    def subset(self, seen: Observations) -> Observations:
        """A random part of the observations with enough pixels in each cell."""
        share = PIXELS_PER_CELL * self.cells.count / max(len(self.cells.of), 1)
        if share >= 1:
            return seen
        kept = np.random.default_rng(0).random(len(seen), np.float32) < share
        return seen.select(np.flatnonzero(kept))


def _summed_variance(levels: list[_Level], error: float) -> NDArray[np.float32]:
    """(n, k) variances of the sum of all levels.

    error: that remains at the end. A level that assumes a larger one counted finer variation as
    noise; the information of its data is scaled to the one that remains, and to CHANNEL_SHARE."""
    found = np.zeros((levels[0].weights.shape[0], len(levels[0].sigma)), np.float32)
    for level in levels:
        prior = np.diag(level.sigma)
        data = np.maximum(1 / np.maximum(level.spread, 1e-12) - 1 / prior, 0)
        data *= (level.error / error) ** 2 * CHANNEL_SHARE / PHOTO_WEIGHT
        found += level.at_nodes(1 / (1 / prior + data))
    return np.asarray(MODEL_ERROR_RATIO**2 * found + INTERPOLATION_ERROR**2, np.float32)


@dataclass(frozen=True)
class _Equations:
    """Normal equations (c, k, k) and right-hand sides (c, k) of c cells; tied: the free parameters
    that are components of the tilt."""

    normal: Array
    right: Array
    tied: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        model: NodeModel,
        seen: Observations,
        normal: NDArray[np.float32],
        theta: NDArray[np.float32],
        cells: Cells,
        which: NDArray[np.intp],
        black: float,
        noise: RadianceError,
        pool: ThreadPoolExecutor | None,
    ) -> _Equations:
        k, free = len(which), np.isin(np.arange(COUNT), which)
        free[TILT] = True  # for the effect of errors of the normals
        cell = cells.of[seen.node]
        order = np.argsort(cell, kind="stable")
        photos = int(seen.photo.max(initial=0)) + 1
        together = np.bincount(cell.astype(np.int64) * photos + seen.photo)

        def sums(part: slice) -> tuple[slice, Array, Array]:
            """(cells, right-hand sides (c, k), matrices (c, k·k)) of a part of the observations."""
            rows = order[part]
            some, at = seen.select(rows), cell[rows]
            residual, slope = log_residuals(model, some, normal, theta, black, free)
            variance = noise.variance(steepness(slope))
            alike = together[at.astype(np.int64) * photos + some.photo]
            weight = weights_of_squares(np.square(residual).mean(axis=1) / variance)
            weight *= PHOTO_WEIGHT / (alike * variance)
            residual, slope = noise.scaled(residual, slope[:, :, which])
            weighted = (slope * weight[:, None, None].astype(np.float32)).transpose(0, 2, 1)
            each = np.matmul(weighted, residual[:, :, None])[:, :, 0]
            product = np.matmul(weighted, slope).reshape(len(rows), k * k)
            into = slice(int(at[0]), int(at[-1]) + 1) if len(at) else slice(0, 0)
            own = _sum_by_cell(at - into.start, into.stop - into.start)
            return into, own @ each, own @ product

        matrix, right = np.zeros((cells.count, k * k)), np.zeros((cells.count, k))
        for into, each, product in map_chunks(pool, sums, len(seen), CHUNK):
            right[into] += each
            matrix[into] += product
        tied = (which >= TILT.start) & (which < TILT.stop)
        return cls(matrix.reshape(-1, k, k), right, tied)

    def around(self, change: Array) -> _Equations:
        """The equations of the whole field instead of its increment. change: (c, k) its present
        values, which the residuals no longer contain."""
        moved = np.einsum("cij,cj->ci", self.normal, change)
        return replace(self, right=self.right + moved)

    def posterior(
        self, sigma: Array, max_tilt: float, pool: ThreadPoolExecutor | None
    ) -> tuple[Array, Array, Array]:
        """(mean (c, k), variance (c, k) of the cells, Σ (k, k)), Σ estimated from ``sigma`` on.
        max_tilt: largest standard deviation of a component of the tilt."""
        sigma = self._tied(sigma, max_tilt)
        seen = np.flatnonzero(np.trace(self.normal, axis1=1, axis2=2) > 0)
        some = seen[:: max(1, len(seen) // EM_CELLS)]
        for _ in range(EM_ROUNDS if len(some) else 0):
            mean, covariance = self._posterior(some, sigma)
            sigma = mean.T @ mean / len(some) + covariance.mean(axis=0)
            sigma = self._tied(sigma, max_tilt)
            sigma[np.diag_indices(len(sigma))] += MIN_DEVIATION**2
        mean = np.zeros((len(self.right), len(sigma)))
        variance = np.tile(np.diag(sigma), (len(self.right), 1))

        def diagonal(part: slice) -> tuple[Array, Array]:
            found, covariance = self._posterior(seen[part], sigma)
            return found, np.diagonal(covariance, axis1=1, axis2=2).copy()

        parts = list(map_chunks(pool, diagonal, len(seen), CHUNK))
        mean[seen], variance[seen] = (np.concatenate(values) for values in zip(*parts, strict=True))
        return mean, variance, sigma

    def _tied(self, sigma: Array, max_tilt: float) -> Array:
        """Σ with the same variance of all components of the tilt, independent of the others."""
        own = np.flatnonzero(self.tied)
        if len(own):
            variance = float(np.diag(sigma)[own].mean())
            sigma = sigma.copy()
            sigma[own] = sigma[:, own] = 0.0
            sigma[own, own] = min(variance, max_tilt**2)
        return sigma

    def _posterior(self, rows: NDArray[np.intp], sigma: Array) -> tuple[Array, Array]:
        """(mean (r, k), covariance (r, k, k)) of cells."""
        covariance = np.linalg.inv(self.normal[rows] + np.linalg.inv(sigma))
        return np.einsum("rij,rj->ri", covariance, self.right[rows]), covariance


def _sum_by_cell(cell: NDArray[np.int32], count: int) -> csc_array:
    """The matrix (count, m) that sums values of m observations over the cells (m,) they are in."""
    starts = np.arange(len(cell) + 1, dtype=np.int32)
    return csc_array((np.ones(len(cell), np.float32), cell, starts), shape=(count, len(cell)))
