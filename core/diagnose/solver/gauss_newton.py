"""Fit BRDF coefficients and effect parameters together: Gauss–Newton with robust weights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .block_elimination import Step, solve
from .jacobian import jacobian_of
from .model import Model
from .model_fit import ModelFit
from .normal_equations import NormalEquations

Array = NDArray[np.floating]

MAX_STEPS, MAX_HALVINGS = 25, 5
CONVERGED = 1e-4  # relative decrease of the cost
DAMPINGS = (1e-3, 1e-2, 0.1, 1.0)  # of steps that are tried where a Gauss–Newton step fails
MAX_BOUND_ROUNDS = 3  # in which further parameters are found to pass a bound


def fit(model: Model, deviation: Array, steps: int = MAX_STEPS, longest: float = 1.0) -> ModelFit:
    """The optimum near the model as it is. deviation: (n, 3) standard deviation in units of
    radiance, inf where a pixel does not count. longest: a step may be doubled up to this length
    while the cost decreases."""
    now = ModelFit.of(model, deviation)
    for _ in range(steps):
        found = _stepped(now, longest)
        gained = now.total_cost - found.total_cost
        now = found if gained > 0 else now
        if not gained >= CONVERGED * max(now.cost, 1.0):  # ends where the cost is not a number
            break
    return now


def _stepped(now: ModelFit, longest: float) -> ModelFit:
    """One Gauss–Newton step, halved until the cost decreases, or doubled while it does, or else
    damped; parameters stay within bounds."""
    equations = equations_of(now)
    step, length = step_within_bounds(now, equations), 1.0
    best = now
    for _ in range(MAX_HALVINGS):
        best = ModelFit.of(_moved(now.model, step, length), now.deviation)
        if best.total_cost < now.total_cost:
            break
        length /= 2
    if not best.total_cost < now.total_cost:
        return _damped_step(now, equations, best)
    while 1.0 <= length < longest:
        length *= 2
        farther = ModelFit.of(_moved(now.model, step, length), now.deviation)
        if not farther.total_cost < best.total_cost:
            break
        best = farther
    return best


def _damped_step(now: ModelFit, equations: NormalEquations, failed: ModelFit) -> ModelFit:
    """The first of several damped steps that decreases the cost (Levenberg–Marquardt); ``failed``
    if none does. Where coefficients, patches and effects compensate for one another, a step is
    right only near its start, in a direction along which the cost falls less than in others."""
    for damping in DAMPINGS:
        step = step_within_bounds(now, equations.damped(damping))
        found = ModelFit.of(_moved(now.model, step, 1.0), now.deviation)
        if found.total_cost < now.total_cost:
            return found
    return failed


def equations_of(now: ModelFit) -> NormalEquations:
    """The normal equations of all pixels."""
    return NormalEquations.of(now, jacobian_of(now), np.arange(len(now.residual)))


def step_within_bounds(now: ModelFit, equations: NormalEquations) -> Step:
    """The step in which global parameters that would pass a bound end at it. All others follow
    them: the coefficients of a BRDF would otherwise compensate for a larger change."""
    step, x = solve(equations, now), now.parameters
    low, high = now.joined(lambda n: n.low), now.joined(lambda n: n.high)
    moves = np.full(len(x), np.nan)
    for _ in range(MAX_BOUND_ROUNDS):
        ends = np.clip(x + step.x, low, high)
        beyond = np.isnan(moves) & (ends != x + step.x)
        if not beyond.any():
            break
        moves[beyond] = (ends - x)[beyond]
        step = solve(equations, now, moves=moves)
    return step


def _moved(model: Model, step: Step, length: float) -> Model:
    """The model after a fraction of a step."""
    coefficients = model.brdfs.coefficients + length * step.coefficients
    brdfs = replace(model.brdfs, coefficients=coefficients)
    parts, at = list(model.x), 0
    for place in model.global_places:
        parameters = model.effects[place].parameters
        moved = parts[place] + length * step.x[at : at + len(parameters)]
        parts[place] = np.clip(moved, parameters.low, parameters.high)
        at += len(parameters)
    if model.patch_place is not None:
        parameters = model.effects[model.patch_place].parameters
        moved = parts[model.patch_place] + length * step.local
        parts[model.patch_place] = np.clip(moved, parameters.low, parameters.high)
    return replace(model, brdfs=brdfs, x=tuple(parts))
