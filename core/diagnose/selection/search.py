"""Stepwise selection of the effects that the photos support.

In each round every effect is tried and the best one accepted. An effect is judged by how much
better the model with it predicts held-out regions (cross_validation.py), and by how likely chance
would do the same (significance.py). At the end every accepted effect must still gain when it is
left out of the full model.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...concurrency.ordered_map import ordered_map
from ..effects.base.capabilities import JudgedByPixel
from ..effects.base.effect import Effect
from ..effects.base.patch_effect import PatchEffect
from ..effects.outside_basis import OutsideBasis
from ..forward.diagnosis_context import DiagnosisContext
from ..solver.gauss_newton import fit
from ..solver.model import Model
from ..solver.model_fit import ModelFit
from ..solver.residual_scale import rescaled_deviation
from .cross_validation import (
    predict_held_out_regions,
    regions,
    standard_error_of_sum,
    sum_by_region,
)
from .diagnosis import MIN_GAIN_FRACTION, Diagnosis
from .effect_trials import held_out_costs, try_effect, try_rebuilt, try_with_rays
from .held_out_error import held_out_errors
from .relative_change import relative_rms_change
from .residual_structure import residual_structure
from .significance import Candidate, rank_candidates
from .trial import MIN_STANDARD_ERRORS, Trial

Array = NDArray[np.floating]

MIN_OUTSIDE_BASIS = 0.002  # RMS change of the photos, relative, that outside_basis has to explain
MAX_ACCEPTED_EFFECTS = 4
# fraction of the time at which each round starts; after the second most searches end
ROUND_STARTS = (0.16, 0.58, 0.92, 0.95, 0.98)
NEARLY_BEST = 0.93  # fraction of the best gain at which the simpler effect is preferred
MIN_TRIALS, PROMISING = 4, 0.25  # fitted at least; and all that promise this much of the best
MAX_PATCH_P_VALUE = 0.05  # of patch effects that are fitted at all
SMALL_GAIN_STANDARD_ERRORS = 5.0  # that a small gain needs, where no structure remains with it
TIE_STANDARD_ERRORS = 2.0  # difference of gains below which two effects are tied


def search(
    model: Model,
    deviation: Array,
    effects: Sequence[Effect],
    context: DiagnosisContext,
    pool: ThreadPoolExecutor | None = None,
) -> Generator[float, None, Diagnosis]:
    """Yields the fraction done. deviation: (n, 3) expected standard deviation of every pixel;
    context: that the effects were built for; pool: threads that try effects in parallel."""
    now = fit(model, deviation)
    expected = deviation
    deviation = rescaled_deviation(deviation, now.residual, now.predicted, model.pixels)
    now = before = fit(now.model, deviation)
    accepted: list[Trial] = []
    rounds: list[tuple[Trial, ...]] = []
    remaining = list(effects)
    failed: dict[str, float] = {}
    for turn in range(MAX_ACCEPTED_EFFECTS):
        yield ROUND_STARTS[turn]
        trials, costs = [], held_out_costs(now)
        promising = [
            one
            for one in _promising(rank_candidates(now, remaining, pool))
            if one.gain > failed.get(one.effect.cause, -np.inf)
        ]
        tried = ordered_map(pool, partial(try_effect, now, costs), promising, ahead=len(promising))
        for place, (one, trial) in enumerate(zip(promising, tried, strict=True)):
            trials.append(trial)
            if trial.gain < 0:  # it is tried again only if it promises more
                failed[one.effect.cause] = one.gain
            share = (place + 1) / (len(promising) + 1)
            yield ROUND_STARTS[turn] + share * (ROUND_STARTS[turn + 1] - ROUND_STARTS[turn])
        trials.sort(key=lambda trial: -trial.gain)
        rounds.append(tuple(trials))
        best = _simplest([t for t in trials if t.is_significant and not t.contradicted_by])
        gained = sum(trial.gain for trial in accepted)
        if best is None or not best.is_accepted:
            break
        best = try_with_rays(now, costs, try_rebuilt(now, costs, best, context), context)
        if best.gain < MIN_GAIN_FRACTION * gained and not _completes_the_model(best):
            break
        accepted.append(best)
        now = best.fitted
        remaining = [e for e in remaining if e.cause != best.effect.cause]
    now, kept = _without_redundant(before, now, accepted, pool)
    # the effect with the largest gain in the full model first
    kept = tuple(sorted((trial.with_photo_errors() for trial in kept), key=lambda t: -t.gain))
    kept = (*kept, *_outside_basis(now, kept))
    held_out = predict_held_out_regions(before), predict_held_out_regions(now)
    return Diagnosis(
        kept, tuple(rounds), before, now, *held_out,
        residual_structure(now),
        held_out_errors(before, held_out[0], expected), held_out_errors(now, held_out[1], expected),
        expected, _contradicted(rounds[0], kept, context.materials),
    )  # fmt: skip


def _completes_the_model(trial: Trial) -> bool:
    """Whether no structure remains with it. A small gain then is not a flaw of the models of the
    effects that were accepted before."""
    significant = trial.gain > SMALL_GAIN_STANDARD_ERRORS * trial.error
    return significant and residual_structure(trial.fitted).gain < 0


def _promising(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates that are fitted: those with the largest expected gain."""
    global_ones = [
        c for c in candidates if not isinstance(c.effect, PatchEffect) and np.isfinite(c.gain)
    ]
    most = max((c.gain for c in global_ones), default=0.0)
    promising = []
    for one in candidates:
        if isinstance(one.effect, PatchEffect):
            fitted = one.p_value < MAX_PATCH_P_VALUE
        else:
            first = any(one is c for c in global_ones[:MIN_TRIALS])
            fitted = one.gain >= PROMISING * most or first
        promising += [one] if fitted else []
    return promising


def _simplest(trials: Sequence[Trial]) -> Trial | None:
    """The simplest of the significant trials (best first) whose gain is nearly that of the best:
    many light sources can imitate uniform ambient light, which is one."""
    if not trials:
        return None
    most = max(trial.gain for trial in trials)
    enough = [trial for trial in trials if trial.gain > NEARLY_BEST * most]
    best = min(enough, key=lambda trial: trial.effect.degrees_of_freedom)
    ties = tuple(trial.effect for trial in trials if trial is not best and _tie(trial, best))
    return replace(best, ties=ties)


def _tie(trial: Trial, best: Trial) -> bool:
    """Whether an effect that is as simple explains the photos as well."""
    one, other = trial.effect, best.effect
    if one.degrees_of_freedom > other.degrees_of_freedom:
        return False
    if isinstance(one, JudgedByPixel) != isinstance(other, JudgedByPixel):
        return False
    error = standard_error_of_sum(trial.by_region - best.by_region)
    return abs(trial.gain - best.gain) < TIE_STANDARD_ERRORS * error


def _contradicted(
    tried: Sequence[Trial], kept: Sequence[Trial], materials: Sequence[str]
) -> dict[str, str]:
    """Cause → evidence against it, of camera effects that gain with one material at the expense of
    another."""
    accepted = {trial.effect.cause for trial in kept}
    return {
        t.effect.cause: "The camera would change all materials alike, but with this cause held-out "
        f"regions of {' and '.join(materials[k] for k in t.contradicted_by)} are predicted worse."
        for t in tried
        if t.contradicted_by and t.is_significant and t.effect.cause not in accepted
    }


def _outside_basis(now: ModelFit, kept: Sequence[Trial]) -> list[Trial]:
    """The gain of the additional basis functions (basis_slack.py). A large gain means that no
    mixture of the measured materials reflects like this. Empty: the gain is small, or the effect is
    in the model already."""
    model = now.model
    if any(isinstance(effect, OutsideBasis) for effect in model.effects):
        return []
    tight = fit(replace(model, brdfs=model.brdfs.tight()), now.deviation)
    held_out = predict_held_out_regions(now)
    gains = predict_held_out_regions(tight).cost - held_out.cost
    change = relative_rms_change(now.predicted, tight.predicted, now.deviation)
    effect = OutsideBasis()
    effects, x = (*model.effects, effect), (*model.x, np.zeros(0))
    fitted = replace(now, model=replace(model, effects=effects, x=x))
    held_out = replace(held_out, variance=(*held_out.variance, np.zeros(0)))
    trial = Trial(effect, fitted, held_out, sum_by_region(regions(now), gains), change, 0.0)
    gained = sum(t.gain for t in kept)
    least = max(MIN_STANDARD_ERRORS * trial.error, MIN_GAIN_FRACTION * gained)
    return [trial] if trial.gain > least and change > MIN_OUTSIDE_BASIS else []


def _without_redundant(
    before: ModelFit, now: ModelFit, accepted: Sequence[Trial], pool: ThreadPoolExecutor | None
) -> tuple[ModelFit, tuple[Trial, ...]]:
    """The model without the effects that gain nothing in it, and the trials of the rest, with
    their gains when each is added to all others."""
    kept = list(accepted)

    def in_full_model(trial: Trial) -> Trial:
        others = before.model
        for other in kept:
            if other is not trial:
                others = others.with_effect(other.effect, other.x)
        without = fit(others, now.deviation)
        candidate = Candidate(trial.effect, 0.0, trial.p_value)
        return replace(try_effect(without, held_out_costs(without), candidate), ties=trial.ties)

    while len(kept) > 1:
        again = list(ordered_map(pool, in_full_model, kept, ahead=len(kept)))
        worst = min(range(len(kept)), key=lambda k: (not again[k].contradicted_by, again[k].gain))
        if again[worst].is_accepted:
            return again[worst].fitted, tuple(again)
        kept.pop(worst)
    if len(kept) == len(accepted):
        return now, tuple(kept)
    candidate = Candidate(kept[0].effect, 0.0, kept[0].p_value)
    alone = try_effect(before, held_out_costs(before), candidate)
    if alone.contradicted_by:
        return before, ()
    return alone.fitted, (replace(alone, ties=kept[0].ties),)
