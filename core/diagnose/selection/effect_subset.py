"""The model with a subset of the accepted effects: a user can switch each of them off."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from ..solver.gauss_newton import fit
from ..solver.model_fit import ModelFit
from .cross_validation import predict_held_out_regions
from .diagnosis import Diagnosis, Trial
from .held_out_error import held_out_errors
from .residual_structure import residual_structure

NO_CORRECTION = ("outside_basis",)  # it frees the BRDF, and changes no sample


def correctable_effects(found: Diagnosis) -> tuple[Trial, ...]:
    """Accepted effects for which samples can be corrected."""
    return tuple(t for t in found.accepted if t.effect.cause not in NO_CORRECTION)


def with_causes(found: Diagnosis, causes: Collection[str]) -> ModelFit:
    """The model at its optimum with some of the accepted causes; if it lacks any of them, the
    parameters of the others are fitted again."""
    selected = [t for t in correctable_effects(found) if t.effect.cause in causes]
    if set(found.after.model.causes).difference(NO_CORRECTION) == {
        t.effect.cause for t in selected
    }:
        return found.after
    relaxing = [t for t in found.accepted if t.effect.cause in NO_CORRECTION]
    if not set(found.after.model.causes).intersection(NO_CORRECTION):
        relaxing = []  # it was accepted for the small slack that every material has
    model = found.before.model
    for trial in (*selected, *relaxing):
        model = model.with_effect(trial.effect, trial.x)
    return fit(model, found.before.deviation)


def with_contradicted(
    found: Diagnosis, contradicted: Mapping[str, str], fitted: ModelFit | None = None
) -> Diagnosis:
    """The diagnosis with evidence against some causes (Diagnosis.contradicted). The other effects
    get the parameters of a fit without these; gains stay those in the full model. contradicted:
    cause → sentence. fitted: a fit with a subset of the causes, used if it is the required one."""
    if not contradicted:
        return found
    sound = {t.effect.cause for t in found.accepted}.difference(contradicted)
    after = with_causes(found if fitted is None else replace(found, after=fitted), sound)
    held_out = predict_held_out_regions(after)

    def anew(trial: Trial) -> Trial:
        cause, model = trial.effect.cause, after.model
        if cause not in sound.difference(NO_CORRECTION) or model.is_frozen(cause):
            return trial
        return replace(trial, fitted=after, held_out=held_out).with_photo_errors()

    return replace(
        found,
        accepted=tuple(map(anew, found.accepted)),
        after=after,
        held_out_after=held_out,
        residual=residual_structure(after),
        error_after=held_out_errors(after, held_out, found.expected),
        contradicted={**found.contradicted, **contradicted},
    )
