"""The model with some of the effects that were found: an artist may switch each off."""

from __future__ import annotations

from collections.abc import Collection

from .fitted import Fitted
from .found import Found, Trial
from .solve import fit

NO_CORRECTION = ("outside_basis",)  # it frees the BRDF, and changes no sample


def can_be_applied(found: Found) -> tuple[Trial, ...]:
    """Accepted effects that samples can be rid of."""
    return tuple(t for t in found.accepted if t.effect.cause not in NO_CORRECTION)


def with_causes(found: Found, causes: Collection[str]) -> Fitted:
    """At its optimum; causes: of those that are accepted. Without some, the others' numbers are
    fitted again."""
    trials = can_be_applied(found)
    if all(t.effect.cause in causes for t in trials):
        return found.after
    loose = [t for t in found.accepted if t.effect.cause in NO_CORRECTION]
    chosen = [t for t in trials if t.effect.cause in causes] + loose
    model = found.before.model
    for trial in chosen:
        model = model.with_effect(trial.effect, trial.x)
    return fit(model, found.before.deviation)
