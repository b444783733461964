"""Cross-validation: the prediction of regions of the photos that a model was not fitted to.

Every photo is divided into square regions. One fold of them at a time is held out; the optimum
moves by the Newton step of the normal equations, which is exact for a linear model, and the
held-out pixels are predicted. Errors of neighbouring pixels are correlated, so regions count as
independent, not pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ...statistics.student_t import robust_cost
from ..effects.base.effect import Effect
from ..nuisances.surface_variation import SurfaceVariation
from ..solver.block_elimination import Step, solve
from ..solver.jacobian import Jacobian, jacobian_of
from ..solver.model_fit import ModelFit
from ..solver.normal_equations import NormalEquations

Array = NDArray[np.floating]

FOLDS = 5  # of regions, and of photos
MIN_GROUPS, MAX_GROUPS = 3, 12  # of photos, held out one after the other
MAX_VARIANCE_RATIO = 25.0  # of a parameter without a fold; beyond, the fold alone determines it


@dataclass(frozen=True)
class HeldOutPrediction:
    """residual: (n, 3) of every pixel, predicted without its region's fold, in units of its
    standard deviation. cost: (n,) nats. variance: of the parameters of each effect, empty for the
    baseline's patches."""

    residual: Array
    cost: Array
    variance: tuple[Array, ...]

    @property
    def mean(self) -> float:
        """Cost of a pixel and channel, nats."""
        return float(self.cost.mean()) / self.residual.shape[1]


def folds(fitted: ModelFit, fine: bool = False) -> NDArray[np.int32]:
    """(n,) fold of every pixel. Regions (fine: pixels) are assigned at random; every fold contains
    regions of every photo."""
    _, place = np.unique(regions(fitted, fine), return_inverse=True)
    shuffled = np.random.default_rng(0).permutation(int(place.max()) + 1 if len(place) else 0)
    return (shuffled[place.ravel()] % FOLDS).astype(np.int32)


def regions(fitted: ModelFit, fine: bool = False) -> NDArray[np.int32]:
    """(n,) region of every pixel; fine: each pixel is its own region."""
    block = fitted.model.pixels.block
    return np.arange(len(block), dtype=np.int32) if fine else block


def predict_held_out_regions(fitted: ModelFit, fine: bool = False) -> HeldOutPrediction:
    """Predict held-out regions at an optimum; fine: single pixels are held out, not their
    neighbours."""
    return _predict_folds(fitted, folds(fitted, fine))


def predict_held_out_photos(fitted: ModelFit) -> HeldOutPrediction | None:
    """Predict held-out photos at an optimum, a fifth of them at a time. Parameters of a single
    photo (its exposure, its pose) keep their values, because no other photo determines them; what
    is validated is common to all photos. None where there is one photo only."""
    of = _photos(fitted, FOLDS)
    return _predict_folds(fitted, of, own=True) if of.max() > 0 else None


def _photos(fitted: ModelFit, most: int) -> NDArray[np.int32]:
    """(n,) group of each pixel's photo: one for each photo unless there are more than ``most``."""
    place = np.unique(fitted.model.pixels.photo, return_inverse=True)[1]
    return (place.ravel() % most).astype(np.int32)


def _predict_folds(fitted: ModelFit, of: NDArray[np.int32], own: bool = False) -> HeldOutPrediction:
    """of: (n,) fold of every pixel; own: parameters that only the held-out fold determines keep
    their values."""
    jacobian = jacobian_of(fitted)
    whole, others, parts = _steps_without_folds(fitted, jacobian, of)
    residual = np.array(fitted.residual, np.float64)
    for fold, (change, part) in enumerate(zip(others, parts, strict=True)):
        mine = np.flatnonzero(of == fold)
        step = _keeping_own(fitted, change, parts, part) if own else change
        residual[mine] -= _change_of_prediction(fitted, jacobian, mine, step)
    variance = _by_effect(fitted, whole, others)
    return HeldOutPrediction(residual, robust_cost(residual).sum(axis=1), variance)


def _keeping_own(
    fitted: ModelFit, change: Step, parts: Sequence[NormalEquations], part: NormalEquations
) -> Step:
    """The step without one fold of the photos, but parameters that no other fold determines stay.
    They only follow the common change of the others, which the BRDF could absorb as well."""
    unknown = _determined_only_by(part.own, [p.own for p in parts])
    x, at = change.x.copy(), 0
    for place in fitted.model.global_places:
        effect = fitted.model.effects[place]
        count = len(effect.parameters)
        identifiable, unknown_here = _identifiable(effect), unknown[at : at + count]
        for k in np.flatnonzero(unknown_here):
            alike = np.flatnonzero((identifiable[k] != 0) & ~unknown_here)
            x[at + k] = change.x[at + alike].mean() if len(alike) else 0.0
        at += count
    gone = _determined_only_by(part.local, [p.local for p in parts]).ravel()
    return replace(change, x=x, local=np.where(gone, 0.0, change.local))


def _determined_only_by(part: Array, parts: Sequence[Array]) -> NDArray[np.bool_]:
    """(..., e) whether a parameter is hardly determined without this fold. part, parts: (..., e, e)
    information of each fold about the parameters, all else being known."""
    mine, whole = (np.diagonal(each, axis1=-2, axis2=-1) for each in (part, sum(parts)))
    return np.asarray(whole - mine < whole / MAX_VARIANCE_RATIO)


def _identifiable(effect: Effect) -> NDArray[np.float64]:
    return np.eye(len(effect.parameters)) if effect.identifiable is None else effect.identifiable


def _steps_without_folds(
    fitted: ModelFit, jacobian: Jacobian, of: NDArray[np.int32]
) -> tuple[Step, list[Step], list[NormalEquations]]:
    """(step for all pixels, steps without each of the folds, normal equations of the folds). of:
    (n,) fold of each pixel."""
    parts = [
        NormalEquations.of(fitted, jacobian, np.flatnonzero(of == part))
        for part in range(of.max() + 1)
    ]
    whole = reduce(NormalEquations.plus, parts)
    others = [solve(whole.plus(part, -1.0), fitted) for part in parts]
    # errors of the baseline's patches take longest, and only parameter_variances has a use for them
    judged = not isinstance(fitted.model.patch_effect, SurfaceVariation)
    return solve(whole, fitted, spread=judged), others, parts


def parameter_variances(fitted: ModelFit) -> tuple[Array, ...]:
    """Variances of the parameters of each effect, at an optimum."""
    everything = np.arange(len(fitted.residual))
    change = solve(NormalEquations.of(fitted, jacobian_of(fitted), everything), fitted, spread=True)
    return _by_effect(fitted, change, [change])


@dataclass(frozen=True)
class ParameterErrors:
    """Errors of the parameters of each effect of a model, in the order of its effects. variances:
    (p,) each. correlations: (p, p) each, from the curvature; None of patches and of effects that
    are not estimated."""

    variances: tuple[Array, ...]
    correlations: tuple[Array | None, ...]


def parameter_errors_by_photo(fitted: ModelFit) -> ParameterErrors | None:
    """Errors of the parameters of each effect by a jackknife over photos: an error of a photo's
    camera pose or exposure is common to all its pixels. None where there are too few photos."""
    of = _photos(fitted, MAX_GROUPS)
    if of.max() < MIN_GROUPS - 1:
        return None
    whole, others, _ = _steps_without_folds(fitted, jacobian_of(fitted), of)
    return ParameterErrors(_by_effect(fitted, whole, others), _correlations(fitted, whole))


def sum_by_region(region: NDArray[np.int32], values: Array) -> NDArray[np.float64]:
    """(b,) sums of values (n,) over the pixels of every region that has some."""
    there = np.bincount(region) > 0
    return np.asarray(np.bincount(region, values)[there], np.float64)


def standard_error_of_sum(sums: NDArray[np.float64]) -> float:
    """Standard error of the sum of independent parts (b,)."""
    return float(np.sqrt(np.sum((sums - sums.mean()) ** 2)))


def _by_effect(fitted: ModelFit, change: Step, others: Sequence[Step]) -> tuple[Array, ...]:
    """Variances of the parameters of each effect from the curvature, but at least those of a
    grouped jackknife (Shao and Wu 1989), averaged over the parameters of an effect: the curvature
    ignores the correlation of neighbouring pixels. others: the steps without each of the groups. A
    group without which a parameter is hardly determined is not used.
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
        usable = moved[(np.stack(spread) <= MAX_VARIANCE_RATIO * plain).all(axis=1)]
        away = usable - usable.mean(axis=0) if len(usable) else np.zeros((1, count))
        jackknife = (len(away) - 1) * np.mean(away**2, axis=0)
        known = plain > 0
        more = float(np.mean(jackknife[known] / plain[known])) if known.any() else 1.0
        variance.append(plain * max(more, 1.0))
        at += count
    return tuple(variance)


def _correlations(fitted: ModelFit, change: Step) -> tuple[Array | None, ...]:
    """Correlations between the parameters of each effect, from the curvature."""
    model, found, at = fitted.model, list[Array | None](), 0
    for place, effect in enumerate(model.effects):
        if place in model.frozen or place == model.patch_place:
            found.append(None)
            continue
        mine = slice(at, at + len(effect.parameters))
        identifiable = _identifiable(effect)
        covariance = identifiable @ change.covariance[mine, mine] @ identifiable.T
        size = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
        found.append(covariance / np.outer(size, size))
        at = mine.stop
    return tuple(found)


def _change_of_prediction(
    fitted: ModelFit, jacobian: Jacobian, rows: NDArray[np.intp], change: Step
) -> Array:
    """(r, 3) change of the prediction by a step, in units of the standard deviation."""
    material = fitted.model.pixels.material[rows]
    out = np.stack([jacobian.matrix(rows, c) @ change.x for c in range(3)], axis=1)
    if jacobian.patches:
        local = [jacobian.local_matrix(rows, c) @ change.local for c in range(3)]
        out += np.stack(local, axis=1)
    for index, coefficients in enumerate(change.coefficients):
        mine = np.flatnonzero(material == index)
        out[mine] += jacobian.rho[rows[mine]] * (jacobian.q[rows[mine]] @ coefficients.T)
    return np.asarray(out)
