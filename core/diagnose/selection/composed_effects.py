"""Effects that contain others: a near lamp also has another direction and another intensity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..solver.model_fit import ModelFit
from .trial import Trial

PARTS: Mapping[str, Sequence[str]] = {"near_light": ("light_direction", "light_intensity")}
"""Effects that are a part of another: only what else it explains is evidence for it."""


def without_parts(now: ModelFit, cause: str) -> ModelFit:
    """The fit from which the joint fit with an effect starts: its parts leave the model, since it
    replaces them. With both in the model, the parameters of the whole could stay plausible while
    those of its parts imitate something else, and neither would be determined."""
    model = now.model
    for part in PARTS.get(cause, ()):
        if part in model.causes:
            model = model.without_effect(part)
    return now if model is now.model else ModelFit.of(model, now.deviation)


def with_parts_replaced(accepted: Sequence[Trial], best: Trial) -> list[Trial]:
    """The accepted effects and one more, which takes the place and the gain of its parts. The gain
    of ``best`` is that beyond the model with these parts."""
    parts = [trial for trial in accepted if trial.effect.cause in PARTS.get(best.effect.cause, ())]
    gained = sum((trial.by_region for trial in parts), best.by_region)
    return [*(t for t in accepted if t not in parts), replace(best, by_region=gained)]
