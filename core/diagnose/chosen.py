"""The model with some of the effects that were found: an artist may switch each off."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from .fitted import Fitted
from .found import Found, Trial
from .held_out import predict_unseen
from .leftover import leftover
from .solve import fit
from .unseen_error import unseen_error

NO_CORRECTION = ("outside_basis",)  # it frees the BRDF, and changes no sample


def can_be_applied(found: Found) -> tuple[Trial, ...]:
    """Accepted effects that samples can be rid of."""
    return tuple(t for t in found.accepted if t.effect.cause not in NO_CORRECTION)


def with_causes(found: Found, causes: Collection[str]) -> Fitted:
    """At its optimum; causes: of those that are accepted. Without some, the others' numbers are
    fitted again."""
    chosen = [t for t in can_be_applied(found) if t.effect.cause in causes]
    if set(found.after.model.causes).difference(NO_CORRECTION) == {t.effect.cause for t in chosen}:
        return found.after
    loose = [t for t in found.accepted if t.effect.cause in NO_CORRECTION]
    if not set(found.after.model.causes).intersection(NO_CORRECTION):
        loose = []  # it was named for what the little slack holds that every material has
    model = found.before.model
    for trial in (*chosen, *loose):
        model = model.with_effect(trial.effect, trial.x)
    return fit(model, found.before.deviation)


def doubting(found: Found, doubted: Mapping[str, str], fitted: Fitted | None = None) -> Found:
    """What is left to say where some causes are doubted (Found.doubted): the others have the
    numbers that are found without these (gains stay what they are missed by in the whole model).
    fitted: with some of the causes, which is taken where they are the right ones."""
    if not doubted:
        return found
    sound = {t.effect.cause for t in found.accepted}.difference(doubted)
    after = with_causes(found if fitted is None else replace(found, after=fitted), sound)
    unseen = predict_unseen(after)

    def anew(trial: Trial) -> Trial:
        cause, model = trial.effect.cause, after.model
        if cause not in sound.difference(NO_CORRECTION) or model.is_settled(cause):
            return trial
        return replace(trial, fitted=after, unseen=unseen).by_photos()

    return replace(
        found,
        accepted=tuple(map(anew, found.accepted)),
        after=after,
        unseen_after=unseen,
        left=leftover(after),
        error_after=unseen_error(after, unseen, found.expected),
        doubted={**found.doubted, **doubted},
    )
