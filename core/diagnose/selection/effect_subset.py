"""The model with some of the effects that were found: an artist may switch each off."""

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
    """Accepted effects that samples can be rid of."""
    return tuple(t for t in found.accepted if t.effect.cause not in NO_CORRECTION)


def with_causes(found: Diagnosis, causes: Collection[str]) -> ModelFit:
    """At its optimum; causes: of those that are accepted. Without some, the others' numbers are
    fitted again."""
    chosen = [t for t in correctable_effects(found) if t.effect.cause in causes]
    if set(found.after.model.causes).difference(NO_CORRECTION) == {t.effect.cause for t in chosen}:
        return found.after
    loose = [t for t in found.accepted if t.effect.cause in NO_CORRECTION]
    if not set(found.after.model.causes).intersection(NO_CORRECTION):
        loose = []  # it was named for what the little slack holds that every material has
    model = found.before.model
    for trial in (*chosen, *loose):
        model = model.with_effect(trial.effect, trial.x)
    return fit(model, found.before.deviation)


def with_contradicted(
    found: Diagnosis, doubted: Mapping[str, str], fitted: ModelFit | None = None
) -> Diagnosis:
    """What is left to say where some causes are doubted (Found.contradicted): the others have the
    numbers that are found without these (gains stay what they are missed by in the whole model).
    fitted: with some of the causes, which is taken where they are the right ones."""
    if not doubted:
        return found
    sound = {t.effect.cause for t in found.accepted}.difference(doubted)
    after = with_causes(found if fitted is None else replace(found, after=fitted), sound)
    unseen = predict_held_out_regions(after)

    def anew(trial: Trial) -> Trial:
        cause, model = trial.effect.cause, after.model
        if cause not in sound.difference(NO_CORRECTION) or model.is_frozen(cause):
            return trial
        return replace(trial, fitted=after, held_out=unseen).with_photo_errors()

    return replace(
        found,
        accepted=tuple(map(anew, found.accepted)),
        after=after,
        held_out_after=unseen,
        residual=residual_structure(after),
        error_after=held_out_errors(after, unseen, found.expected),
        contradicted={**found.contradicted, **doubted},
    )
