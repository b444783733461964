"""One Newton step of an effect's parameters on top of the baseline, and how well it predicts parts
of the photos that it was not fitted to.

The baseline's unknowns (BRDFs, the patches of the surface, poses) are projected out of the effect's
derivatives once (Frisch and Waugh 1933): what is left of a derivative is what only this effect can
explain. A step, its standard error, its gain and its gain on held-out regions, photos or parts of
the surface then are sums over pixels of a few columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ...statistics.student_t import robust_cost, robust_weights
from ..effects.base.effect import Effect
from ..effects.base.parameters import Parameters
from ..solver.block_elimination import (
    dense_matrix,
    inverse_of_blocks,
    patch_blocks,
    projected_squares,
    times_blocks,
)
from ..solver.jacobian import Jacobian, effect_derivatives, jacobian_of
from ..solver.model_fit import ModelFit
from ..solver.normal_equations import NormalEquations
from .relative_change import relative_rms_change

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

REWEIGHTINGS = 4  # a large effect looks like outliers until a part of it is explained


@dataclass(frozen=True)
class ProjectedBaseline:
    """The baseline's derivatives, ready to be projected out of others.

    jacobian, equations: of the baseline. weight: (n, 3) robust weights. inverse: (P, e, e) of the
    patches' blocks. side: (M + p, P · e) coupling of the other unknowns with the patches. dense:
    (M + p, M + p) inverse of what is left of these when the patches are eliminated.
    """

    fit: ModelFit
    jacobian: Jacobian
    weight: Array
    inverse: Array
    side: Array
    dense: Array

    @classmethod
    def of(cls, fit: ModelFit) -> ProjectedBaseline:
        """fit: the baseline at its optimum."""
        jacobian = jacobian_of(fit)
        equations = NormalEquations.of(fit, jacobian, np.arange(len(fit.residual)))
        model = fit.model
        matrix = dense_matrix(equations, fit)
        side = np.concatenate([equations.local_coupling, equations.local_own])
        inverse = np.zeros((0, 0, 0))
        if len(equations.local):
            assert model.patch_place is not None
            deviation = model.effects[model.patch_place].parameters.deviation
            free = np.zeros(len(deviation), bool)
            inverse, roots = inverse_of_blocks(patch_blocks(equations.local, deviation, free))
            matrix -= projected_squares(side, roots)
        weight = robust_weights(fit.residual)
        return cls(fit, jacobian, weight, inverse, side, np.linalg.inv(matrix))

    def solve(self, columns: Array, local: Array) -> tuple[Array, Array]:
        """Baseline unknowns (M + p, q), (P · e, q) that imitate an effect: the inverse Hessian
        times columns (M + p, q), local (P · e, q)."""
        if not len(self.inverse):
            return self.dense @ columns, local
        eliminated = times_blocks(local.T, self.inverse).T  # (P e, q)
        first = self.dense @ (columns - self.side @ eliminated)
        second = eliminated - times_blocks((self.side.T @ first).T, self.inverse).T
        return first, second

    def project(self, derivative: Array) -> Array:
        """(n, 3, q) the part of derivatives (n, 3, q), in units of the pixels' deviations, that the
        baseline cannot imitate."""
        fit, jacobian = self.fit, self.jacobian
        m, _, k = fit.model.brdfs.coefficients.shape
        material, q = fit.model.pixels.material, derivative.shape[2]
        weighted = derivative * self.weight[..., None].astype(np.float32)
        columns = np.zeros((m, 3, k, q))
        for index in range(m):
            mine = np.flatnonzero(material == index)
            for c in range(3):
                rows = weighted[mine, c] * jacobian.rho[mine, c, None]
                columns[index, c] = jacobian.q[mine].T @ rows
        everything = np.arange(len(derivative))
        own = np.zeros((jacobian.count, q))
        local = np.zeros((jacobian.patches * jacobian.local.shape[2], q))
        for c in range(3):
            own += jacobian.matrix(everything, c).T @ weighted[:, c]
            if jacobian.patches:
                local += jacobian.local_matrix(everything, c).T @ weighted[:, c]
        joined = np.concatenate([columns.reshape(m * 3 * k, q), own])
        first, second = self.solve(joined, local)
        coefficients = first[: m * 3 * k].reshape(m, 3, k, q)
        left = np.array(derivative, np.float32)
        for index in range(m):
            mine = np.flatnonzero(material == index)
            for c in range(3):
                imitated = jacobian.q[mine] @ coefficients[index, c].astype(np.float32)
                left[mine, c] -= jacobian.rho[mine, c, None] * imitated
        for c in range(3):
            left[:, c] -= jacobian.matrix(everything, c) @ first[m * 3 * k :]
            if jacobian.patches:
                left[:, c] -= jacobian.local_matrix(everything, c) @ second
        return left


@dataclass(frozen=True)
class OneStep:
    """x: (q,) parameters of the effect after one step; covariance: (q, q) of these, the baseline's
    unknowns free; prior: (q,) their standard deviations before. gain: nats. change: RMS change of
    the photos by the step, relative, the baseline's unknowns unchanged. left: (n, 3, q) what only
    this effect explains; score: (n, q) derivatives of the log-likelihood of each pixel;
    residual: (n, 3) before the step; weight: (n, 3) robust weights after it. free: (q,) parameters
    that no bound holds."""

    effect: Effect
    x: Vector
    covariance: Array
    prior: Vector
    gain: float
    change: float
    left: Array
    score: Array
    residual: Array
    weight: Array
    free: NDArray[np.bool_]

    def held_out(self, group: NDArray[np.integer]) -> NDArray[np.float64]:
        """(g,) nats by which each group of pixels is predicted better by the step that the other
        groups give. group: (n,)."""
        _, of = np.unique(group, return_inverse=True)
        of = of.ravel()
        count, q = int(of.max()) + 1, len(self.x)
        scores = np.stack([np.bincount(of, self.score[:, j], count) for j in range(q)], axis=1)
        order = np.argsort(of, kind="stable")
        members = np.split(order, np.cumsum(np.bincount(of, minlength=count))[:-1])
        information = np.zeros((count, q, q))
        for g, rows in enumerate(members):
            part = self.left[rows].reshape(-1, q)
            information[g] = part.T @ (self.weight[rows].reshape(-1, 1) * part)
        whole, total = information.sum(axis=0) + np.diag(1 / self.prior**2), scores.sum(axis=0)
        out = np.zeros(count)
        declared, free = self.effect.parameters, np.flatnonzero(self.free)
        at = np.ix_(free, free)
        for g, rows in enumerate(members):
            step = np.where(self.free, 0.0, self.x)
            pull = total - scores[g] - (whole - information[g]) @ step
            step[free] = np.linalg.solve((whole - information[g])[at], pull[free])
            step = np.clip(step, declared.low, declared.high).astype(np.float32)
            residual = self.residual[rows]
            rest = residual - self.left[rows] @ step
            out[g] = (robust_cost(residual) - robust_cost(rest)).sum()
        return out


def one_step(baseline: ProjectedBaseline, effect: Effect) -> OneStep:
    """The step of an effect that is not in the model. An effect with a starting value is linear
    between 0 and that value."""
    fit, start = baseline.fit, effect.parameters.initial
    absent = fit.model.with_effect(effect, np.zeros(len(effect.parameters)))
    place = len(absent.effects) - 1
    if len(start) == 1 and start[0] != 0:
        present = replace(absent, x=(*absent.x[:-1], start))
        rise = (present.predicted() - fit.predicted) / start[0] / fit.deviation
        derivative = rise[..., None].astype(np.float32)
    else:
        derivative = effect_derivatives(absent, fit.deviation, place)
    left = baseline.project(derivative)
    residual = np.where(np.isfinite(fit.residual), fit.residual, 0.0).astype(np.float32)
    found = _minimum(left, residual, [effect.parameters])
    moved = np.einsum("ncq,q->nc", derivative, effect.identified(found.x))
    moved = moved * np.where(np.isfinite(fit.deviation), fit.deviation, 0.0)
    change = relative_rms_change(fit.predicted + moved, fit.predicted, fit.deviation)
    return OneStep(
        effect, found.x, np.linalg.inv(found.matrix), effect.parameters.deviation, found.gain,
        change, left, found.score, residual, found.weight, found.free,
    )  # fmt: skip


def joint_step(steps: Sequence[OneStep]) -> float:
    """Nats that several effects gain together."""
    left = np.concatenate([step.left for step in steps], axis=2)
    return _minimum(left, steps[0].residual, [step.effect.parameters for step in steps]).gain


@dataclass(frozen=True)
class _Minimum:
    """x: (q,); matrix: (q, q) second derivatives of the cost; score, weight, free, gain: as of
    OneStep."""

    x: Vector
    matrix: Array
    score: Array
    weight: Array
    free: NDArray[np.bool_]
    gain: float


def _minimum(left: Array, residual: Array, declared: Sequence[Parameters]) -> _Minimum:
    """The parameters that explain a residual (n, 3) best by columns left (n, 3, q)."""
    low, high, prior = (
        np.concatenate([getattr(one, name) for one in declared])
        for name in ("low", "high", "deviation")
    )
    q, precision = left.shape[2], prior**-2.0
    flat, weight = left.reshape(-1, q).astype(np.float64), robust_weights(residual)
    for _ in range(REWEIGHTINGS):
        weighted = left * weight[..., None].astype(np.float32)
        score = np.einsum("ncq,nc->nq", weighted, residual).astype(np.float64)
        matrix = flat.T @ weighted.reshape(-1, q) + np.diag(precision)
        x, free = bounded_minimum(matrix, score.sum(axis=0), low, high, float(precision.min()))
        rest = residual - left @ x.astype(np.float32)
        weight = robust_weights(rest)
    saved = float((robust_cost(residual) - robust_cost(rest)).sum())
    gain = saved - 0.5 * float(np.sum((x / prior) ** 2))
    return _Minimum(x, matrix, score, weight, free, gain)


def bounded_minimum(
    matrix: Array, pull: Vector, low: Vector, high: Vector, least: float
) -> tuple[Vector, NDArray[np.bool_]]:
    """(x (q,), whether no bound holds each): the minimum of x · matrix · x / 2 − pull · x within
    bounds. least: that no eigenvalue of the matrix (q, q) is below, except by rounding: of noise-
    free photos, black pixels weigh so much that it can become indefinite."""
    x = np.linalg.solve(matrix, pull)
    if ((x > low) & (x < high)).all():
        return x, np.ones(len(x), bool)
    eigenvalues, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    root = np.sqrt(np.maximum(eigenvalues, least))
    target = vectors.T @ pull / root
    found = lsq_linear(root[:, None] * vectors.T, target, (low, high), method="bvls")
    return found.x, found.active_mask == 0
