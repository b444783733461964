"""A joint fit of a displaced lamp that starts far from the optimum.

Derivatives do not know that shadows move, patches of the surface take up what a displaced lamp does
to them, and robust weights reduce the influence of the pixels that show the displacement. A fit
that starts with all three ends too early: for lamps displaced by 7.2° it found 3.6° to 6.8°
(docs/notebook/field-hunt.md). This one starts with a wide distribution of errors and a surface that
does not vary, and traces shadows again after a few steps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..effects.base.capabilities import DisplacesLamp
from ..forward.diagnosis_context import DiagnosisContext
from ..solver.gauss_newton import fit
from ..solver.model import Model, Vector
from ..solver.model_fit import ModelFit

WIDENINGS = (8.0, 4.0, 2.0, 1.0, 1.0)
"""Factors of the expected standard deviation, one a round. With the first, nearly all pixels have
the full weight; shadows are traced again before each."""
STEPS_EACH = 4  # a round
LONGEST_STEP = 4.0  # of a step: these steps are too short where the lamp moves far
FREE_ROUNDS = 2  # rounds with patches that vary
MIN_DISPLACEMENT = 1e-3  # prior standard deviations; below it, shadows are not traced again


def fit_displaced_lamp(now: ModelFit, effect: DisplacesLamp, context: DiagnosisContext) -> ModelFit:
    """The joint fit of a model and a displaced lamp, the last effect of the result. effect: not in
    the model; its shadows may be those of any displacement."""
    model = _even(now.model).with_effect(effect, effect.parameters.initial)
    for widening in WIDENINGS:
        model = _with_rays(model, context)
        model = fit(model, now.deviation * widening, STEPS_EACH, LONGEST_STEP).model
    model = replace(model, frozen=now.model.frozen)
    for _ in range(FREE_ROUNDS):
        model = fit(_with_rays(model, context), now.deviation, STEPS_EACH, LONGEST_STEP).model
    return ModelFit.of(model, now.deviation)


def _even(model: Model) -> Model:
    """The model with patches that do not vary, frozen."""
    place = model.patch_place
    if place is None:
        return model
    values = list(model.x)
    values[place] = np.zeros_like(values[place])
    return replace(model, x=tuple(values)).with_patches_frozen()


def _with_rays(model: Model, context: DiagnosisContext) -> Model:
    """The model with shadows of its last effect traced again where it displaces the lamp."""
    effect, x = model.effects[-1], model.x[-1]
    assert isinstance(effect, DisplacesLamp)
    if not _displaces(effect, x):
        return model
    return replace(model, effects=(*model.effects[:-1], effect.with_rays(context, x)))


def _displaces(effect: DisplacesLamp, x: Vector) -> bool:
    return bool(np.any(np.abs(x) > MIN_DISPLACEMENT * effect.parameters.deviation))
