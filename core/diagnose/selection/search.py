"""The search for the effects that the photos support, on a baseline that knows scans.

The baseline has what every scan gets wrong (baseline.py). In each round one step of every effect is
judged on held-out regions (evidence.py), the best convincing one (judgement.py) is fitted together
with everything else, and it is accepted if held-out regions confirm it. Shadows and clipped
highlights are spots and plateaus, which no step from their absence describes: they are fitted where
the photos show signs of them. What the baseline itself measures is named where it is unusual
(unusual_scan.py).
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from ...concurrency.ordered_map import ordered_map
from ..effects.base.effect import Effect
from ..effects.cast_shadow import CastShadow
from ..effects.clipping import Clipping
from ..forward.diagnosis_context import DiagnosisContext
from ..solver.model_fit import ModelFit
from .baseline import fit_baseline
from .composed_effects import with_parts_replaced, without_parts
from .cross_validation import parameter_errors_by_photo
from .diagnosis import MIN_GAIN_FRACTION, Diagnosis
from .effect_trials import (
    HeldOutPredictions,
    held_out_predictions,
    try_effect,
    try_rebuilt,
    try_with_rays,
)
from .evidence import Evidence, evidence_for, has_one_step
from .held_out_error import held_out_errors
from .judgement import best_of, confirmed, contenders, has_sufficient_evidence, underestimated
from .one_step import ProjectedBaseline
from .residual_structure import residual_structure
from .scan_quality import ScanQuality
from .trial import MIN_STANDARD_ERRORS, Array, Trial
from .unusual_scan import unusual_causes, with_unusual_normals, with_unusual_poses

MAX_ROUNDS = 3  # of effects that are accepted one after the other
# fraction of the time at which the baseline is fitted, and at which each round starts
BASELINE_DONE, ROUND_STARTS = 0.3, (0.3, 0.6, 0.8, 0.95)


def search(
    context: DiagnosisContext,
    normal_deviation: float,
    effects: Sequence[Effect],
    pool: ThreadPoolExecutor | None = None,
) -> Generator[float, None, Diagnosis]:
    """Yields the fraction done. normal_deviation: radians along each tangent, of the scan's
    normals. effects: built for the context. pool: threads that judge effects in parallel."""
    baseline = fit_baseline(context, normal_deviation)
    yield BASELINE_DONE
    now = before = baseline.fitted
    first = without = held_out_predictions(now)
    accepted: list[Trial] = []
    rounds: list[tuple[Trial, ...]] = []
    remaining = list(effects)
    for turn in range(MAX_ROUNDS):
        known = now.model.causes
        stepping = [e for e in remaining if has_one_step(e) and e.cause not in known]
        evidence = evidence_for(ProjectedBaseline.of(now), stepping, pool)
        yield 0.5 * (ROUND_STARTS[turn] + ROUND_STARTS[turn + 1])
        found = _tried(now, without, evidence, remaining, context, pool)
        fitted = {trial.effect.cause for trial in found}
        steps = (one.trial for one in evidence if one.cause not in fitted)
        rounds.append((*found, *steps))
        yield ROUND_STARTS[turn + 1]
        gained = sum(trial.gain for trial in accepted)
        found = [
            t
            for t in found
            if t.is_accepted and t.gain > MIN_GAIN_FRACTION * gained and has_sufficient_evidence(t)
        ]
        if not found:
            break
        best = max(found, key=lambda trial: trial.gain)
        assert best.fitted is not None
        accepted = with_parts_replaced(accepted, best)
        now = best.fitted
        without = held_out_predictions(now)
        remaining = [e for e in remaining if e.cause != best.effect.cause]
    usual = now
    now, quality, posed = _with_unusual_scan(now, context)
    without = without if now is usual else held_out_predictions(now)
    held_out = first(False, False), without(False, False)  # of regions, patches not frozen
    kept = sorted(_in_final_fit(accepted, now, held_out[1].variance), key=lambda trial: -trial.gain)
    kept += posed
    kept += unusual_causes(baseline.plain, now, quality)
    expected = before.deviation
    return Diagnosis(
        tuple(kept), tuple(rounds), before, now, *held_out, residual_structure(now),
        held_out_errors(before, held_out[0], expected), held_out_errors(now, held_out[1], expected),
        expected, quality, _contradicted(rounds, kept, context.materials),
    )  # fmt: skip


def _with_unusual_scan(
    now: ModelFit, context: DiagnosisContext
) -> tuple[ModelFit, ScanQuality, list[Trial]]:
    """The joint fit with errors of the scan that are larger than usual, the scan's quality in that
    fit, and the trial of the camera poses where these are to be named."""
    quality = ScanQuality.of(now)
    normals = with_unusual_normals(now, quality)
    quality = quality if normals is now else ScanQuality.of(normals)
    found, posed = with_unusual_poses(normals, quality, context)
    return found, quality if found is normals else ScanQuality.of(found), posed


def _tried(
    now: ModelFit,
    without: HeldOutPredictions,
    evidence: Sequence[Evidence],
    remaining: Sequence[Effect],
    context: DiagnosisContext,
    pool: ThreadPoolExecutor | None,
) -> list[Trial]:
    """Joint fits of spots and plateaus, and of the effect that the evidence supports best."""
    spots = _spots_and_plateaus(now, remaining, context)
    supported = contenders(evidence)
    causes = {one.cause for one in supported}
    supported += [one for one in underestimated(evidence) if one.cause not in causes]

    def trial_of(one: Effect | Evidence) -> Trial:
        if isinstance(one, Effect):
            return try_effect(now, without, one)
        start = without_parts(now, one.cause)
        trial = try_effect(start, without, one.step.effect, one.trial.p_value)
        return try_rebuilt(start, without, trial, context) if len(supported) > 1 else trial

    wanted: list[Effect | Evidence] = [*spots, *supported]
    trials = list(ordered_map(pool, trial_of, wanted, ahead=2))
    found, trials = trials[: len(spots)], trials[len(spots) :]
    best = best_of(confirmed(trials, supported))
    if best is None:
        return [*found, *trials]
    ties, start = best.ties, without_parts(now, best.effect.cause)
    best = try_rebuilt(start, without, best, context) if len(supported) == 1 else best
    return [*found, replace(try_with_rays(start, without, best, context), ties=ties)]


def _spots_and_plateaus(
    now: ModelFit, remaining: Sequence[Effect], context: DiagnosisContext
) -> list[Effect]:
    """Shadows and clipped highlights, where the photos show signs of them."""
    wanted = {effect.cause for effect in remaining}
    shadows = CastShadow.in_residual(context, now.predicted, now.residual)
    found: list[Effect] = [] if shadows is None else [shadows]
    for effect in remaining:
        if isinstance(effect, Clipping) and effect.shows_plateau(now.predicted, now.deviation):
            found.append(effect)
    return [effect for effect in found if effect.cause in wanted]


def _contradicted(
    rounds: Sequence[Sequence[Trial]], kept: Sequence[Trial], materials: Sequence[str]
) -> dict[str, str]:
    """Cause → evidence against it, of camera effects that gain with one material at the expense of
    another."""
    accepted = {trial.effect.cause for trial in kept}
    return {
        t.effect.cause: "The camera would change all materials alike, but with this cause held-out "
        f"regions of {' and '.join(materials[k] for k in t.contradicted_by)} are predicted worse."
        for trials in rounds
        for t in trials
        if t.contradicted_by and t.ratio > MIN_STANDARD_ERRORS
        if t.effect.cause not in accepted
    }


def _in_final_fit(
    accepted: Sequence[Trial], now: ModelFit, variances: tuple[Array, ...]
) -> list[Trial]:
    """The accepted effects with their parameters in the final joint fit. variances: of the
    parameters of each effect there."""
    found = []
    by_photo = parameter_errors_by_photo(now) if accepted else None
    for trial in accepted:
        place = now.model.place_of(trial.effect.cause)
        frozen = place in now.model.frozen
        moved = trial if frozen else trial.in_fit(now, variances)
        found.append(replace(moved, fitted=now).with_photo_errors(by_photo))
    return found
