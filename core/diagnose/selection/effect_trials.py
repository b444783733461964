"""Fit an effect together with a model, and measure its gain on held-out regions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..effects.base.capabilities import (
    AffectsHighlightsOnly,
    BuiltFromBRDFs,
    DisplacesLamp,
    JudgedByPixel,
    TracesRays,
)
from ..effects.base.effect import Effect
from ..effects.base.image_formation import CameraEffect
from ..effects.base.patch_effect import PatchEffect
from ..forward.diagnosis_context import DiagnosisContext
from ..pixels.unexplained_shadows import DIM
from ..solver.gauss_newton import fit
from ..solver.model import Model
from ..solver.model_fit import ModelFit
from ..solver.scaled_brdfs import scaled_brdfs
from .cross_validation import (
    HeldOutPrediction,
    parameter_variances,
    predict_held_out_regions,
    regions,
    standard_error_of_sum,
    sum_by_region,
)
from .held_out_error import held_out_rms
from .lamp_search import fit_displaced_lamp
from .relative_change import relative_rms_change
from .trial import Trial

Array = NDArray[np.floating]
Vector = NDArray[np.float64]
HeldOutPredictions = Callable[[bool, bool], HeldOutPrediction]
"""(single pixels are held out, patches are frozen) → the prediction of every held-out pixel."""

STEPS = 8  # of a joint fit, which starts at the optimum without the effect
PRIOR_ROUNDS = 1  # rounds of expectation and maximisation for the prior of patches
MAX_RAY_ROUNDS = 3  # rounds in which rays are traced anew for a moved lamp or photo
MIN_RAY_GAIN = 0.02  # of the gain, that another such round has to bring
CONTRADICTION = 2.0  # standard errors that a material loses by a camera effect
MIN_REGIONS = 10  # of a material, below which it cannot contradict anything


def held_out_predictions(now: ModelFit) -> HeldOutPredictions:
    """The held-out predictions of a model, computed when first needed, and only once."""
    one_at_a_time = Lock()

    @cache
    def predicted(by_pixel: bool, patches_frozen: bool) -> HeldOutPrediction:
        base = replace(now, model=now.model.with_patches_frozen()) if patches_frozen else now
        return predict_held_out_regions(base, by_pixel)

    def locked(by_pixel: bool, patches_frozen: bool) -> HeldOutPrediction:
        with one_at_a_time:
            return predicted(by_pixel, patches_frozen)

    return locked


def try_effect(
    now: ModelFit,
    before: HeldOutPredictions,
    effect: Effect,
    p_value: float = 0.0,
    start: ModelFit | None = None,
) -> Trial:
    """Fit one effect together with the model. before: held_out_predictions(now); p_value: of its
    step; start: a joint fit with another version of the effect, from which the search starts."""
    by_pixel, in_patches = isinstance(effect, JudgedByPixel), isinstance(effect, PatchEffect)
    # another patch effect freezes the patches of the model, so they must be frozen without it too:
    # the parameters of a held-out region are then known
    frozen = in_patches and now.model.patch_place is not None
    fitted = fit(_with_effect(now, effect, start), now.deviation, STEPS)
    for _ in range(PRIOR_ROUNDS):
        if isinstance(effect, PatchEffect):
            effect = effect.with_prior(patch_prior(fitted))
            model = now.model.with_effect(effect)
            model = replace(model, brdfs=fitted.model.brdfs, x=fitted.model.x)
            fitted = fit(model, now.deviation, STEPS)
    held_out = predict_held_out_regions(fitted, by_pixel)
    # single pixels, since the gain of an effect in a few regions could never be significant
    without_it = before(by_pixel, frozen)
    saved = without_it.cost - held_out.cost
    by_region = sum_by_region(regions(now, by_pixel), saved)
    place = fitted.model.place_of(effect.cause)
    without = fitted.model.predicted_without(effect.cause) if not in_patches else now.predicted
    highlights = isinstance(effect, AffectsHighlightsOnly)
    change = relative_rms_change(fitted.predicted, without, now.deviation, highlights)
    contradicted = _materials_that_lose(now, saved) if isinstance(effect, CameraEffect) else ()
    return Trial(
        effect, fitted.model.x[place], np.asarray(held_out.variance[place], np.float64), by_region,
        fitted.residual.size, change, p_value, fitted, contradicted_by=contradicted,
        growth=held_out_rms(fitted, held_out) / max(held_out_rms(now, without_it), 1e-30),
    )  # fmt: skip


def _with_effect(now: ModelFit, effect: Effect, start: ModelFit | None) -> Model:
    """The model with one more effect, where its joint fit starts."""
    if start is None or len(start.model.x[-1]) != len(effect.parameters):
        first = effect.initial(_residual_where_bright(now), now.predicted)
        return now.model.with_effect(effect, first)
    return replace(start.model, effects=(*start.model.effects[:-1], effect))


def try_rebuilt(
    now: ModelFit, before: HeldOutPredictions, best: Trial, context: DiagnosisContext
) -> Trial:
    """The trial with the BRDFs of the fit that includes the effect, since the BRDFs of the fit
    without it have absorbed a part of it. In finer detail where that gains more. Unchanged where no
    BRDF matters, or where these BRDFs gain less: in directions that no photo shows they are less
    reliable than those of the first fit."""
    if not isinstance(best.effect, BuiltFromBRDFs) or best.fitted is None:
        return best
    context = replace(context, brdfs=scaled_brdfs(best.fitted.model))
    effects: list[Effect] = [best.effect.rebuilt(context, best.x)]
    if len(effects[0].parameters) != len(best.effect.parameters):
        plain = best.effect.of(context)
        effects += [] if plain is None else [plain]
    tried = [try_effect(now, before, effect, best.p_value, best.fitted) for effect in effects]
    return max((best, *tried), key=lambda trial: trial.gain)


def try_with_rays(
    now: ModelFit, before: HeldOutPredictions, best: Trial, context: DiagnosisContext
) -> Trial:
    """The trial with visibility traced again for the displaced lamp or photos; unchanged if the
    effect displaces neither."""
    if isinstance(best.effect, DisplacesLamp) and best.fitted is not None:
        start = fit_displaced_lamp(now, best.effect, context)
        again = try_effect(now, before, start.model.effects[-1], best.p_value, start)
        best = max((best, again), key=lambda trial: trial.gain)
    for _ in range(MAX_RAY_ROUNDS):
        if not isinstance(best.effect, TracesRays) or best.fitted is None:
            break
        predict = partial(_predicted_with_last, best.fitted.model)
        x = best.effect.ray_parameters(context, best.x, predict)
        effect = best.effect.with_rays(context, x)
        again = try_effect(now, before, effect, best.p_value, best.fitted)
        if again.gain < best.gain:  # the mesh is too coarse to locate the edges of shadows
            break
        converged = again.gain < (1 + MIN_RAY_GAIN) * best.gain
        best = again
        if converged:
            break
    return best


def _predicted_with_last(model: Model, effect: Effect, x: Vector) -> Array:
    """(n, 3) prediction with another version of the model's last effect."""
    last = replace(model, effects=(*model.effects[:-1], effect), x=(*model.x[:-1], x))
    return last.predicted()


def _materials_that_lose(now: ModelFit, saved: Array) -> tuple[int, ...]:
    """Materials whose held-out regions are predicted significantly worse."""
    material = now.model.pixels.material
    found = []
    for index in np.unique(material):
        mine = np.flatnonzero(material == index)
        gained = sum_by_region(regions(now)[mine], saved[mine])
        loss = CONTRADICTION * standard_error_of_sum(gained)
        if len(gained) > MIN_REGIONS and gained.sum() < -loss:
            found.append(int(index))
    return tuple(found)


def _residual_where_bright(now: ModelFit) -> Array:
    """(n, 3) photo minus prediction, 0 where the prediction is dark or the photo clipped."""
    bright = now.predicted > DIM * np.percentile(now.predicted, 90)
    counted = bright & np.isfinite(now.deviation)
    return np.where(counted, now.model.pixels.observed - now.predicted, 0.0)


def patch_prior(fitted: ModelFit) -> Vector:
    """(e,) standard deviations of the parameters of patches: root mean square of the estimates with
    their variances added (one step of expectation and maximisation)."""
    model, effect = fitted.model, fitted.model.patch_effect
    assert model.patch_place is not None and effect is not None
    variance = parameter_variances(fitted)[model.patch_place]
    each = (np.square(model.x[model.patch_place]) + variance).reshape(effect.count, -1)
    return np.asarray(np.maximum(np.sqrt(each.mean(axis=0)), 1e-3))
