"""Solve the normal equations by eliminating blocks (Schur complements).

Coefficients are eliminated block by block, so that neither the BRDFs can absorb an effect nor an
effect the BRDFs without the other being free to change too. Where an effect has parameters for many
patches, these are eliminated first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...linear_algebra import row_gram, solve_positive
from ..effects.base.parameters import Parameters
from .model_fit import ModelFit
from .normal_equations import NormalEquations

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

ROUNDING = 1e-6  # relative, of sums of products of 32-bit numbers


@dataclass(frozen=True)
class Step:
    """A Gauss–Newton step. coefficients: (m, 3, k). x: (p,) of the global parameters. local:
    (P · e,) of the patches' parameters. covariance: (p, p) of the global parameters.
    local_variance: (P · e,) of the patches', empty unless requested."""

    coefficients: Array
    x: Vector
    local: Vector
    covariance: Array
    local_variance: Vector


@dataclass(frozen=True)
class EliminatedBlocks:
    """solutions: for each block of coefficients (k, w), the block's inverse times w columns."""

    solutions: tuple[Array, ...]

    @classmethod
    def of(cls, blocks: Array, variance: Vector, columns: Array) -> EliminatedBlocks:
        """blocks: (..., k, k) without the prior; variance: (k,) of the prior; columns: (M, w)."""
        k = blocks.shape[-1]
        found = []
        for index, block in enumerate(blocks.reshape(-1, k, k)):
            rows = slice(k * index, k * index + k)
            found.append(solve_positive(block + np.diag(1 / variance), columns[rows]))
        return cls(tuple(found))

    def schur_complement(self, matrix: Array, coupling: Array, columns: slice | int) -> Array:
        """matrix − couplingᵀ · blocks⁻¹ · columns, for some of the columns."""
        for index, solution in enumerate(self.solutions):
            k = len(solution)
            rows = slice(k * index, k * index + k)
            matrix = matrix - coupling[rows].T @ solution[:, columns]
        return matrix


def with_prior(equations: NormalEquations, fit: ModelFit) -> Array:
    """(p, p) matrix of the global parameters with their prior."""
    prior = fit.joined(lambda parameters: parameters.deviation)
    return np.asarray(equations.own + np.diag(1 / prior**2))


def dense_matrix(equations: NormalEquations, fit: ModelFit) -> Array:
    """(M + p, M + p) matrix of coefficients and global parameters with their priors."""
    k, size = equations.blocks.shape[-1], len(equations.pull)
    dense = np.zeros((size + len(equations.own),) * 2)
    for index, block in enumerate(equations.blocks.reshape(-1, k, k)):
        rows = slice(k * index, k * index + k)
        dense[rows, rows] = block + np.diag(1 / fit.model.brdfs.variance)
    dense[:size, size:], dense[size:, :size] = equations.coupling, equations.coupling.T
    dense[size:, size:] = with_prior(equations, fit)
    return dense


def times_blocks(rows: Array, blocks: Array) -> Array:
    """(r, P · e) rows (r, P · e) times blocks (P, e, e)."""
    count, e, _ = blocks.shape
    each = rows.reshape(-1, count, e).transpose(1, 0, 2) @ blocks
    return np.asarray(each.transpose(1, 0, 2).reshape(len(rows), -1))


def projected_squares(rows: Array, roots: Array) -> Array:
    """(r, r) rows · blocks · rowsᵀ for rows (r, P · e) and the roots (P, e, e) of blocks: a product
    of a matrix with its own transpose takes half the time."""
    return row_gram(times_blocks(rows, roots))


def inverse_of_blocks(blocks: Array) -> tuple[Array, Array]:
    """(inverse (P, e, e) of symmetric positive definite blocks, and its roots R: inverse = R · Rᵀ).
    The roots come from those of the blocks: the inverse of a block with a pixel that decides
    nearly all is not positive definite after rounding. Neither may the block be, which a larger
    diagonal mends."""
    try:
        lower = np.linalg.cholesky(blocks)
    except np.linalg.LinAlgError:
        lower = np.linalg.cholesky(blocks * (1 + ROUNDING * np.eye(blocks.shape[1])))
    roots = np.linalg.inv(lower).transpose(0, 2, 1)
    return roots @ roots.transpose(0, 2, 1), roots


def solve(
    equations: NormalEquations,
    fit: ModelFit,
    spread: bool = False,
    moves: Vector | None = None,
) -> Step:
    """The step of the maximum a posteriori; parameters that a bound holds do not move. spread: with
    the variances of the patches' parameters, which take longest. moves: (p,) of global parameters
    whose step is known, NaN where it is not; all others follow them."""
    known = np.full(len(equations.own), np.nan) if moves is None else moves
    if len(equations.local):
        return _solve_with_patches(equations, fit, spread, known)
    brdfs = fit.model.brdfs
    own = with_prior(equations, fit)
    right = equations.own_pull - fit.identified / _prior(fit) ** 2
    pull = equations.pull - (brdfs.coefficients / brdfs.variance).ravel()
    columns = np.column_stack([equations.coupling, pull])
    eliminated = EliminatedBlocks.of(equations.blocks, brdfs.variance, columns)
    own = eliminated.schur_complement(own, equations.coupling, slice(0, -1))
    right = eliminated.schur_complement(right, equations.coupling, -1)
    held, moved = _held(fit, right), np.nan_to_num(known)
    free = np.flatnonzero(~held & np.isnan(known))
    covariance = np.zeros_like(own)
    covariance[np.ix_(free, free)] = np.linalg.inv(own[np.ix_(free, free)])
    x = covariance @ (right - own @ moved) + moved
    change = np.stack([found[:, -1] - found[:, :-1] @ x for found in eliminated.solutions])
    none = np.zeros(0)
    return Step(change.reshape(brdfs.coefficients.shape), x, none, covariance, none)


def _solve_with_patches(
    equations: NormalEquations, fit: ModelFit, spread: bool, moves: Vector
) -> Step:
    """Patches are eliminated first: the remaining matrix is dense, but small. moves: as of
    ``solve``."""
    model = fit.model
    assert model.patch_place is not None
    parameters, y = model.effects[model.patch_place].parameters, model.x[model.patch_place]
    m, _, k = model.brdfs.coefficients.shape
    size, p = len(equations.pull), len(equations.own)
    dense = dense_matrix(equations, fit)
    coefficients = (model.brdfs.coefficients / model.brdfs.variance).ravel()
    own_pull = equations.own_pull - fit.identified / _prior(fit) ** 2
    right = np.concatenate([equations.pull - coefficients, own_pull])
    side = np.concatenate([equations.local_coupling, equations.local_own])  # (M + p, P · e)
    pull = equations.local_pull.ravel() - y / parameters.deviation**2
    held = _at_bound(y, pull, parameters)
    side, pull = np.where(held, 0, side), np.where(held, 0, pull)
    blocks = patch_blocks(equations.local, parameters.deviation, held)
    inverse, roots = inverse_of_blocks(blocks)
    dense -= projected_squares(side, roots)
    right = right - side @ _blockwise(inverse, pull)
    stuck = np.concatenate([np.zeros(size, bool), _held(fit, right[size:]) | ~np.isnan(moves)])
    free = np.flatnonzero(~stuck)
    moved = np.concatenate([np.zeros(size), np.nan_to_num(moves)])
    known = np.concatenate([(right - dense @ moved)[:, None], np.eye(size + p)[:, size:]], axis=1)
    solved = np.zeros((size + p, 1 + p))
    solved[free] = solve_positive(dense[np.ix_(free, free)], known[free])
    z, covariance = solved[:, 0] + moved, solved[size:, 1:]
    local = _blockwise(inverse, pull - side.T @ z)
    variance = np.zeros(0)
    if spread:
        projected = times_blocks(side, inverse)
        alone = np.einsum("pee->pe", inverse).ravel()
        through = solve_positive(dense[np.ix_(free, free)], projected[free])
        variance = np.where(held, 0, alone + np.einsum("sy,sy->y", projected[free], through))
    return Step(z[:size].reshape(m, 3, k), z[size:], np.where(held, 0, local), covariance, variance)


def _prior(fit: ModelFit) -> Vector:
    """(p,) prior standard deviations of the global parameters."""
    return fit.joined(lambda parameters: parameters.deviation)


def patch_blocks(local: Array, deviation: Vector, held: NDArray[np.bool_]) -> Array:
    """(P, e, e) blocks with the prior; parameters that a bound holds are decoupled."""
    count, e, _ = local.shape
    out = local.copy()
    out[:, range(e), range(e)] += (1 / deviation**2).reshape(count, e)
    stuck = held.reshape(count, e)
    out = np.where(stuck[:, :, None] | stuck[:, None, :], 0, out)
    out[:, range(e), range(e)] += stuck
    return out


def _blockwise(inverse: Array, pull: Vector) -> Vector:
    """(P · e,) blocks (P, e, e) times a vector (P · e,)."""
    count, e, _ = inverse.shape
    return np.asarray(np.einsum("pef,pf->pe", inverse, pull.reshape(count, e)).ravel())


def _at_bound(x: Vector, pull: Vector, parameters: Parameters) -> NDArray[np.bool_]:
    """(p,) whether a parameter is at a bound and pulled beyond it."""
    return ((x <= parameters.low) & (pull <= 0)) | ((x >= parameters.high) & (pull >= 0))


def _held(fit: ModelFit, pull: Vector) -> NDArray[np.bool_]:
    """(p,) the same for the global parameters."""
    low, high = fit.joined(lambda n: n.low), fit.joined(lambda n: n.high)
    x = fit.parameters
    return np.asarray(((x <= low) & (pull <= 0)) | ((x >= high) & (pull >= 0)))
