"""What a model predicts of parts of the photos that it was not fitted to.

Every photo is cut into squares; a part of them at a time is left out, the optimum moves as the
normal equations say (a Newton step, which is exact for a linear model), and the left-out pixels are
predicted. What neighbouring pixels err by is alike, so it is squares that count as independent, not
pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ...statistics.student_t import robust_cost
from ..effects.base.effect import Effect
from ..solver.block_elimination import Step, solve
from ..solver.jacobian import Jacobian, jacobian_of
from ..solver.model_fit import ModelFit
from ..solver.normal_equations import NormalEquations

Array = NDArray[np.floating]

FOLDS = 5
FEWEST_GROUPS, MOST_GROUPS = 3, 12  # of photos, left out one after the other
STILL_KNOWN = 25.0  # times the variance of a number where a part of the photos is left out


@dataclass(frozen=True)
class HeldOutPrediction:
    """residual: (n, 3) of every pixel, predicted without its square's fold, in units of its
    deviation. cost: (n,) nats. variance: of the numbers of each effect."""

    residual: Array
    cost: Array
    variance: tuple[Array, ...]

    @property
    def mean(self) -> float:
        """Cost of a pixel and channel, nats."""
        return float(self.cost.mean()) / self.residual.shape[1]


def folds(fitted: ModelFit, fine: bool = False) -> NDArray[np.int32]:
    """(n,) fold of every pixel: squares at random, or pixels; every photo is in every fold."""
    _, place = np.unique(regions(fitted, fine), return_inverse=True)
    shuffled = np.random.default_rng(0).permutation(int(place.max()) + 1 if len(place) else 0)
    return (shuffled[place.ravel()] % FOLDS).astype(np.int32)


def regions(fitted: ModelFit, fine: bool = False) -> NDArray[np.int32]:
    """(n,) square of every pixel; fine: each is one of its own."""
    block = fitted.model.pixels.block
    return np.arange(len(block), dtype=np.int32) if fine else block


def predict_held_out_regions(fitted: ModelFit, fine: bool = False) -> HeldOutPrediction:
    """At an optimum; fine: single pixels are left out, whose neighbours stay."""
    return _unseen(fitted, folds(fitted, fine))


def predict_held_out_photos(fitted: ModelFit) -> HeldOutPrediction | None:
    """At an optimum, whole photos left out, a fifth of them at a time. Numbers that are a photo's
    own (its exposure, its pose) stay as they were found: no other photo could tell them, and it is
    what all photos have in common that is judged. None where there is one photo only."""
    of = _photos(fitted, FOLDS)
    return _unseen(fitted, of, own=True) if of.max() > 0 else None


def _photos(fitted: ModelFit, most: int) -> NDArray[np.int32]:
    """(n,) group of each pixel's photo, one a photo unless there are more than ``most``."""
    place = np.unique(fitted.model.pixels.photo, return_inverse=True)[1]
    return (place.ravel() % most).astype(np.int32)


def _unseen(fitted: ModelFit, of: NDArray[np.int32], own: bool = False) -> HeldOutPrediction:
    """of: (n,) fold of every pixel; own: numbers that the rest knows nothing of stay."""
    slopes = jacobian_of(fitted)
    whole, others, parts = _left_out(fitted, slopes, of)
    residual = np.array(fitted.residual, np.float64)
    for fold, (change, part) in enumerate(zip(others, parts, strict=True)):
        mine = np.flatnonzero(of == fold)
        step = _keeping_own(fitted, change, parts, part) if own else change
        residual[mine] -= _moved(fitted, slopes, mine, step)
    variance = _by_effect(fitted, whole, others)
    return HeldOutPrediction(residual, robust_cost(residual).sum(axis=1), variance)


def _keeping_own(
    fitted: ModelFit, change: Step, parts: Sequence[NormalEquations], part: NormalEquations
) -> Step:
    """The step without a part of the photos, but for numbers that no other part tells of. What all
    of them have in common, and the BRDF could as well have, they follow."""
    unknown = _told_alone_by(part.own, [p.own for p in parts])
    x, at = change.x.copy(), 0
    for place in fitted.model.global_places:
        effect = fitted.model.effects[place]
        count = len(effect.parameters)
        identifiable, lost = _identifiable(effect), unknown[at : at + count]
        for k in np.flatnonzero(lost):
            alike = np.flatnonzero((identifiable[k] != 0) & ~lost)
            x[at + k] = change.x[at + alike].mean() if len(alike) else 0.0
        at += count
    gone = _told_alone_by(part.local, [p.local for p in parts]).ravel()
    return replace(change, x=x, local=np.where(gone, 0.0, change.local))


def _told_alone_by(part: Array, parts: Sequence[Array]) -> NDArray[np.bool_]:
    """(..., e) whether hardly anything is known of a number without this part; (..., e, e) each:
    what the parts' pixels say of the numbers, were all else known."""
    mine, whole = (np.diagonal(each, axis1=-2, axis2=-1) for each in (part, sum(parts)))
    return np.asarray(whole - mine < whole / STILL_KNOWN)


def _identifiable(effect: Effect) -> NDArray[np.float64]:
    return np.eye(len(effect.parameters)) if effect.identifiable is None else effect.identifiable


def _left_out(
    fitted: ModelFit, slopes: Jacobian, of: NDArray[np.int32]
) -> tuple[Step, list[Step], list[NormalEquations]]:
    """The steps that all pixels ask for, and that they do without each of the parts (n,); the
    parts' own equations."""
    parts = [
        NormalEquations.of(fitted, slopes, np.flatnonzero(of == part))
        for part in range(of.max() + 1)
    ]
    whole = reduce(NormalEquations.plus, parts)
    others = [solve(whole.plus(part, -1.0), fitted) for part in parts]
    return solve(whole, fitted, spread=True), others, parts


def parameter_variances(fitted: ModelFit) -> tuple[Array, ...]:
    """Of the numbers of each effect, at an optimum."""
    everything = np.arange(len(fitted.residual))
    change = solve(NormalEquations.of(fitted, jacobian_of(fitted), everything), fitted, spread=True)
    return _by_effect(fitted, change, [change])


def parameter_variances_by_photo(fitted: ModelFit, before: tuple[Array, ...]) -> tuple[Array, ...]:
    """Of the numbers of each effect, but no less than what they move by when photos are left out:
    what a photo's camera pose or exposure is off by errs alike all over it. before: as they are
    otherwise known to be."""
    of = _photos(fitted, MOST_GROUPS)
    if of.max() < FEWEST_GROUPS - 1:
        return before
    whole, others, _ = _left_out(fitted, jacobian_of(fitted), of)
    found = _by_effect(fitted, whole, others)
    return tuple(np.maximum(a, b) for a, b in zip(found, before, strict=True))


def sum_by_region(square: NDArray[np.int32], values: Array) -> NDArray[np.float64]:
    """(b,) sums of values (n,) over the pixels of every square that has some."""
    there = np.bincount(square) > 0
    return np.asarray(np.bincount(square, values)[there], np.float64)


def standard_error_of_sum(sums: NDArray[np.float64]) -> float:
    """Standard error of the sum of independent parts (b,)."""
    return float(np.sqrt(np.sum((sums - sums.mean()) ** 2)))


def _by_effect(fitted: ModelFit, change: Step, others: Sequence[Step]) -> tuple[Array, ...]:
    """As the curvature says, but no less than what the numbers move by when parts of the photos are
    left out, others: (a jackknife of as many groups, Shao and Wu 1989, together over an effect's
    numbers): what neighbouring pixels err by is alike, which the curvature does not know. A part
    without which one of the numbers is hardly known says nothing about them.
    """
    model, variance, at = fitted.model, [], 0
    for place, effect in enumerate(model.effects):
        count = len(effect.parameters)
        if place in model.frozen:
            variance.append(np.zeros(0))
            continue
        if place == model.patch_place:
            variance.append(change.local_variance)
            continue
        mine = slice(at, at + count)
        identifiable = _identifiable(effect)
        plain = np.diag(identifiable @ change.covariance[mine, mine] @ identifiable.T)
        moved = np.stack([other.x[mine] for other in others]) @ identifiable.T
        spread = [np.diag(identifiable @ o.covariance[mine, mine] @ identifiable.T) for o in others]
        told = moved[(np.stack(spread) <= STILL_KNOWN * plain).all(axis=1)]
        away = told - told.mean(axis=0) if len(told) else np.zeros((1, count))
        jackknife = (len(away) - 1) * np.mean(away**2, axis=0)
        known = plain > 0
        more = float(np.mean(jackknife[known] / plain[known])) if known.any() else 1.0
        variance.append(plain * max(more, 1.0))
        at += count
    return tuple(variance)


def _moved(fitted: ModelFit, slopes: Jacobian, rows: NDArray[np.intp], change: Step) -> Array:
    """(r, 3) what the prediction changes by, in units of the deviation."""
    material = fitted.model.pixels.material[rows]
    out = np.stack([slopes.matrix(rows, c) @ change.x for c in range(3)], axis=1)
    if slopes.patches:
        local = [slopes.local_matrix(rows, c) @ change.local for c in range(3)]
        out += np.stack(local, axis=1)
    for index, coefficients in enumerate(change.coefficients):
        mine = np.flatnonzero(material == index)
        out[mine] += slopes.rho[rows[mine]] * (slopes.q[rows[mine]] @ coefficients.T)
    return np.asarray(out)
