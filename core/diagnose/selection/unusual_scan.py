"""Causes that the baseline measures itself, named where they are beyond what scans usually have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...statistics.student_t import robust_cost
from ..effects.base.effect import Effect
from ..effects.camera_pose import CameraPose
from ..effects.normal_error import NormalError
from ..effects.outside_basis import OutsideBasis
from ..effects.second_material import SecondMaterial
from ..forward.diagnosis_context import DiagnosisContext
from ..nuisances.fine_variation import log_albedo_of_patches
from ..nuisances.pose_jitter import PoseJitter
from ..nuisances.surface_variation import ALBEDO, WAYS, SurfaceVariation
from ..solver.gauss_newton import fit
from ..solver.model_fit import ModelFit
from .baseline import PRIOR_ROUNDS
from .cross_validation import parameter_errors_by_photo, sum_by_region
from .effect_trials import (
    STEPS,
    held_out_predictions,
    patch_prior,
    try_effect,
    try_with_rays,
)
from .relative_change import relative_rms_change
from .scan_quality import UNUSUAL_MATERIAL, UNUSUAL_NORMALS, UNUSUAL_POSES, ScanQuality
from .trial import Trial

MIN_APART, MIN_SEPARATION = 0.3, 5.0
"""Distance of two groups of patches in ln reflectance, and in their standard deviations: stains and
paint of another shade reach 4.2 standard deviations."""
MAX_BETWEEN = 0.04  # share of the surface halfway between both groups
MIN_SHARE = 0.03  # of the surface in each group
LIT, DARKEST = 0.2, 0.05  # of the 90th percentile of irradiance; smallest factor of reflectance
SEEDS, ROUNDS = 5, 30  # patches from which groups are grown, and steps of that


def with_unusual_normals(now: ModelFit, quality: ScanQuality) -> ModelFit:
    """The joint fit with normals that may be far off; unchanged where they are as usual. It is done
    with the accepted effects in the model: patches that are all tilted would explain a wrong
    light direction. quality: of the scan in this fit."""
    model = now.model
    place, effect = model.patch_place, model.patch_effect
    if quality.normals is None or quality.normals < UNUSUAL_NORMALS or place is None:
        return now
    for _ in range(PRIOR_ROUNDS):
        assert isinstance(effect, SurfaceVariation)
        effects = list(now.model.effects)
        effects[place] = effect.with_prior(patch_prior(now))
        now = fit(replace(now.model, effects=tuple(effects)), now.deviation, STEPS)
    return now


def with_unusual_poses(
    now: ModelFit, quality: ScanQuality, context: DiagnosisContext
) -> tuple[ModelFit, list[Trial]]:
    """The joint fit with camera poses that may be far off, and the trial of these; unchanged where
    the poses are as usual. quality: of the scan in this fit."""
    if quality.poses < UNUSUAL_POSES:
        return now, []
    exact = fit(now.model.without_effect(PoseJitter.cause), now.deviation, STEPS)
    without = held_out_predictions(exact)
    trial = try_effect(exact, without, CameraPose.of(context))
    trial = try_with_rays(exact, without, trial, context)
    if not trial.is_accepted or trial.fitted is None:
        return now, []
    by_photo = parameter_errors_by_photo(trial.fitted)
    return trial.fitted, [trial.with_photo_errors(by_photo)]


def unusual_causes(plain: ModelFit, now: ModelFit, quality: ScanQuality) -> list[Trial]:
    """Errors of the normals, a second material and a material outside the basis. now: the last
    joint fit; quality: of the scan, as that fit shows it. The gain of such a cause is that of the
    baseline's nuisances over plain, a fit with an exact, uniform surface."""
    found = list[Effect]()
    if quality.normals is not None and quality.normals > UNUSUAL_NORMALS:
        found.append(NormalError((quality.normals,)))
    second = _second_material(now)
    found += [] if second is None else [SecondMaterial(second)]
    if quality.outside > UNUSUAL_MATERIAL:
        found.append(OutsideBasis((quality.outside,)))
    return [_named(effect, plain, now) for effect in found]


def _second_material(now: ModelFit) -> tuple[float, float] | None:
    """(share of the surface that differs, its relative reflectance) where the patches form two
    groups with a gap between them; None where their reflectance varies around one mean."""
    model = now.model
    place = next((k for k, e in enumerate(model.effects) if isinstance(e, SurfaceVariation)), None)
    if place is None:
        return None
    effect = model.effects[place]
    assert isinstance(effect, SurfaceVariation)
    level = _log_reflectance(now, place, effect)
    size = np.bincount(effect.patch[effect.patch >= 0], minlength=effect.count).astype(float)
    groups = _two_groups(level, size)
    if groups is None:
        return None
    other, along = groups
    share = float(size[other].sum() / size.sum())
    first, second = (_mean_and_spread(along[m], size[m]) for m in (~other, other))
    apart = second[0] - first[0]
    part = (along - first[0]) / apart
    between = size[(part > 1 / 3) & (part < 2 / 3)].sum() / size.sum()
    spread = np.sqrt(0.5 * (first[1] ** 2 + second[1] ** 2))
    if apart < max(MIN_APART, MIN_SEPARATION * spread) or between > MAX_BETWEEN:
        return None
    if not MIN_SHARE < share < 1 - MIN_SHARE:
        return None
    rest = np.average(level[~other].mean(axis=1), weights=size[~other])
    change = np.average(level[other].mean(axis=1), weights=size[other]) - rest
    return (share, float(np.exp(change) - 1)) if share < 0.5 else (1 - share, np.expm1(-change))


def _log_reflectance(now: ModelFit, place: int, effect: SurfaceVariation) -> NDArray[np.float64]:
    """(P, 3) ln of each patch's reflectance, relative to the median patch."""
    model, x = now.model, list(now.model.x)
    x[place] = np.zeros_like(x[place])
    even, received = replace(model, x=tuple(x)).predicted(), effect.received
    level = received.mean(axis=1)
    lit = level > LIT * np.percentile(level, 90)
    albedo = np.maximum(np.median(np.pi * even[lit] / received[lit], axis=0), 1e-6)
    patches = model.x[place].reshape(effect.count, -1)
    first = WAYS.index(ALBEDO[0])
    factor = 1 + patches[:, first, None] + patches[:, first + 1 : first + 4] / albedo
    found = np.log(np.maximum(factor, DARKEST)) + log_albedo_of_patches(model.effects, effect.patch)
    return np.asarray(found - np.median(found, axis=0))


def _two_groups(
    level: NDArray[np.float64], size: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]] | None:
    """((P,) whether a patch is in the second group, (P,) position along the line between the means
    of both groups), by 2-means from the patches that differ most; the division that explains most
    of the variance. None: they do not divide. level: (P, 3); size: (P,) pixels."""
    best, most = None, 0.0
    far = np.argsort(-np.linalg.norm(level, axis=1) * np.sqrt(size))[:SEEDS]
    for seed in far:
        means = np.zeros(3), level[seed]
        for _ in range(ROUNDS):
            second = np.linalg.norm(level - means[1], axis=1) < np.linalg.norm(
                level - means[0], axis=1
            )
            if min(np.count_nonzero(second), np.count_nonzero(~second)) < 2:
                break
            means = (
                np.average(level[~second], axis=0, weights=size[~second]),
                np.average(level[second], axis=0, weights=size[second]),
            )
        else:
            axis = (means[1] - means[0]) / max(float(np.linalg.norm(means[1] - means[0])), 1e-9)
            along = level @ axis
            first, other = (_mean_and_spread(along[m], size[m]) for m in (~second, second))
            share = size[second].sum() / size.sum()
            explained = share * (1 - share) * (other[0] - first[0]) ** 2
            if explained > most:
                best, most = (second, along), explained
    return best


def _mean_and_spread(
    values: NDArray[np.float64], weight: NDArray[np.float64]
) -> tuple[float, float]:
    """Weighted mean and standard deviation."""
    mean = float(np.average(values, weights=weight))
    return mean, float(np.sqrt(np.average((values - mean) ** 2, weights=weight)))


def _named(effect: Effect, plain: ModelFit, now: ModelFit) -> Trial:
    counted = np.isfinite(now.deviation)
    unit = np.where(counted, plain.deviation, 1.0) / np.where(counted, now.deviation, 1.0)
    gains = _cost(plain.residual * unit) - _cost(now.residual)
    change = relative_rms_change(now.predicted, plain.predicted, now.deviation)
    none = np.zeros(0)
    by_region = sum_by_region(now.model.pixels.block, gains)
    return Trial(effect, none, none, by_region, now.residual.size, change, 0.0, now)


def _cost(residual: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.asarray(robust_cost(np.nan_to_num(residual)).sum(axis=1))
