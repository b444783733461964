"""The baseline of a diagnosis on a real scan: BRDFs, poses, and what varies over the surface.

Variation finer than a patch is known before (fine_variation.py) and part of the model. Patches may
then differ from it as much as it varies itself: where few photos show a place, it has absorbed a
part of a cause, which would be found too small otherwise.

The scales of the surface's priors are found from the photos by expectation and maximisation
(empirical Bayes), but never beyond what scans usually have: a wrong light direction would otherwise
be explained by normals that are all wrong.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..forward.diagnosis_context import DiagnosisContext
from ..nuisances.fine_variation import FineVariation, log_albedo_of_patches
from ..nuisances.material_scale import MaterialScale
from ..nuisances.pose_jitter import PoseJitter
from ..nuisances.surface_variation import ALBEDO, WAYS, SurfaceVariation
from ..solver.gauss_newton import fit
from ..solver.model import Model
from ..solver.model_fit import ModelFit
from ..solver.residual_scale import expected_deviation, rescaled_deviation
from .effect_trials import patch_prior

ACROSS = 36  # patches over the object's size: finer ones hold too few pixels, coarser ones leave
# more of the errors of a stereo mesh (held-out regions of ../shared/data are predicted worse)
PRIOR_ROUNDS = 2
RELAXATION = 2.0
"""Factor by which the logarithm of a step of expectation and maximisation is lengthened, since such
steps are slow. They never go beyond the optimum, so a factor of up to 2 keeps them stable."""
STEPS, STEPS_OF_ROUND, LAST_STEPS = 4, 3, 8
USUAL_SCALES = (*(np.radians(0.6),) * 2, *(np.radians(0.4),) * 3, 0.4, *(0.05,) * 3, 0.02)
"""Largest standard deviations of the priors (SurfaceVariation): normals of stereo meshes are off by
0.8° in the median and by 3 to 4° at the 95th percentile, less in the mean over a patch; paint and
patina vary by up to 40 %."""


@dataclass(frozen=True)
class Baseline:
    """plain: the fit with one BRDF for each material, an exact and even surface and exact poses.
    fitted: with errors of poses and the surface's variation; scales: (e,) of the priors of the
    latter; None: the surface is too small for patches."""

    plain: ModelFit
    fitted: ModelFit
    scales: NDArray[np.float64] | None


def fit_baseline(
    context: DiagnosisContext, normal_deviation: float, across: int = ACROSS
) -> Baseline:
    """normal_deviation: radians along each tangent, of the scan's normals. across: patches over the
    object's size."""
    expected = expected_deviation(context.pixels, context.brdfs, normal_deviation)
    model = Model(context.pixels, context.brdfs).with_effect(MaterialScale.of(context))
    plain = fit(model, expected)
    deviation = rescaled_deviation(expected, plain.residual, plain.predicted, context.pixels)
    plain = fit(plain.model, deviation)
    varied = plain
    fine = FineVariation.of(context)
    if fine is not None:
        varied = fit(_with_fine_variation(plain.model, fine), deviation)
        deviation = rescaled_deviation(deviation, varied.residual, varied.predicted, context.pixels)
    posed = varied.model.with_effect(PoseJitter.of(context))
    variation = SurfaceVariation.across(context, across)
    if variation is None:
        return Baseline(plain, fit(posed, deviation), None)
    least = _least_scales(posed, variation)
    now = fit(posed.with_effect(variation), deviation, STEPS)
    scales = np.array(variation.prior)
    for _ in range(PRIOR_ROUNDS):
        scales = scales * (patch_prior(now) / scales) ** RELAXATION
        scales = np.minimum(np.maximum(scales, least), USUAL_SCALES)
        model = posed.with_effect(variation.with_prior(scales))
        model = replace(model, brdfs=now.model.brdfs, x=now.model.x)
        deviation = rescaled_deviation(deviation, now.residual, now.predicted, context.pixels)
        now = fit(model, deviation, STEPS_OF_ROUND)
    # nearer to the optimum: otherwise steps of a joint fit would count as the gain of its effect
    return Baseline(plain, fit(now.model, deviation, LAST_STEPS), scales)


def _with_fine_variation(model: Model, fine: FineVariation) -> Model:
    """The model on a surface that varies as it is known; this acts first and is not fitted."""
    frozen = frozenset({0, *(place + 1 for place in model.frozen)})
    return replace(model, effects=(fine, *model.effects), x=(np.zeros(0), *model.x), frozen=frozen)


def _least_scales(model: Model, variation: SurfaceVariation) -> NDArray[np.float64]:
    """(e,) smallest standard deviations of the priors: of brightness, that of the known variation
    between patches."""
    known = log_albedo_of_patches(model.effects, variation.patch).mean(axis=1)
    least = np.zeros(len(WAYS))
    least[WAYS.index(ALBEDO[0])] = known.std()
    return least
