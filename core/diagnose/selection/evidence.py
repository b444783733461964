"""The evidence for every effect that is not in the model: one step, judged on held-out regions."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from ...concurrency.ordered_map import ordered_map
from ..effects.base.capabilities import JudgedByPixel
from ..effects.base.effect import Effect
from ..effects.base.patch_effect import PatchEffect
from ..effects.camera_pose import CameraPose
from .one_step import OneStep, ProjectedBaseline, one_step
from .trial import Trial


@dataclass(frozen=True)
class Evidence:
    """trial: of the step, judged on held-out regions."""

    step: OneStep
    trial: Trial

    @property
    def cause(self) -> str:
        """Of the effect."""
        return self.step.effect.cause


def has_one_step(effect: Effect) -> bool:
    """Whether a step about its absence is evidence for an effect: not for spots, plateaus and
    patches, nor for poses, whose errors the baseline has."""
    without = PatchEffect | JudgedByPixel | CameraPose
    return len(effect.parameters) > 0 and not isinstance(effect, without)


def evidence_for(
    baseline: ProjectedBaseline, effects: Sequence[Effect], pool: ThreadPoolExecutor | None = None
) -> list[Evidence]:
    """Best first. effects: those with a step (has_one_step). pool: threads for several at once."""
    region, values = baseline.fit.model.pixels.block, baseline.fit.residual.size

    def of(effect: Effect) -> Evidence:
        step = max((one_step(baseline, one) for one in effect.starts), key=lambda s: s.gain)
        gains = step.held_out(region)
        variance = np.diag(step.covariance).copy()
        trial = Trial(step.effect, step.x, variance, gains, values, step.change, 1.0)
        return Evidence(step, replace(trial, p_value=_p_value(trial.ratio, len(effects))))

    found = ordered_map(pool, of, effects, ahead=2)
    return sorted(found, key=lambda one: -one.trial.gain)


def _p_value(ratio: float, count: int) -> float:
    """Probability that the largest of ``count`` gains is ``ratio`` standard errors by chance
    (Bonferroni)."""
    return float(min(1.0, count * ndtr(-ratio)))
