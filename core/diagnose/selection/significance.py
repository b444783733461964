"""Score test of every effect before it is fitted, with p-values from a sign-flip test.

The score of an effect's parameters is summed over square regions of the photos, which count as
independent. Flipping the signs of whole regions at random (the wild cluster bootstrap: Cameron,
Gelbach & Miller 2008, "Bootstrap-based improvements for inference with clustered errors") gives the
distribution under chance, for all effects at once, so that many tests do not make a false alarm
likely.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import gamma

from ...concurrency.ordered_map import ordered_map
from ..effects.base.capabilities import JudgedByPixel
from ..effects.base.effect import Effect
from ..solver.jacobian import jacobian_of
from ..solver.model_fit import ModelFit
from .score_test import scores

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

DRAWS = 2000  # of random signs


@dataclass(frozen=True)
class Candidate:
    """gain: nats expected from a step of the effect's parameters. p_value: probability that chance
    explains the score, over all effects tested at once."""

    effect: Effect
    gain: float
    p_value: float


def rank_candidates(
    now: ModelFit, effects: Sequence[Effect], pool: ThreadPoolExecutor | None = None
) -> list[Candidate]:
    """Score tests of effects that are not in the model, best first. pool: threads that run them in
    parallel."""
    _, of = np.unique(now.model.pixels.block, return_inverse=True)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (DRAWS, int(of.max()) + 1))

    def test(effect: Effect) -> tuple[Candidate, Vector | None]:
        tries = [test_start(one) for one in effect.starts]
        best, draws = max(tries, key=lambda each: each[0].gain)
        return replace(best, p_value=min(1.0, best.p_value * len(tries))), draws

    def test_start(effect: Effect) -> tuple[Candidate, Vector | None]:
        by_pixel = isinstance(effect, JudgedByPixel)  # which the signs of regions do not test
        if by_pixel or not len(effect.parameters):
            return Candidate(effect, np.inf, 0.0), None
        region_scores, metric = _scores(now, effect, of)
        draws = _length(signs @ region_scores, metric)
        value = float(_length(region_scores.sum(axis=0)[None], metric)[0])
        expected = (value - float(draws.mean())) / 2  # beyond what chance gives
        return Candidate(effect, expected, float(_tail(draws, np.array([value]))[0])), draws

    answers = list(ordered_map(pool, test, effects, ahead=len(effects)))
    found, drawn = [a for a, _ in answers], [d for _, d in answers if d is not None]
    if drawn:
        # each effect's own distribution makes effects of different freedom comparable
        smallest = np.sort(np.min([_tail(d, d) for d in drawn], axis=0))
        found = [replace(a, p_value=max(a.p_value, _within(smallest, a.p_value))) for a in found]
    return sorted(found, key=lambda a: -a.gain)


def _length(score: Array, metric: Array) -> Vector:
    """(d,) squared lengths of scores (d, P · e) under a metric (P, e, e)."""
    parts = score.reshape(len(score), *metric.shape[:2])
    return np.einsum("dpe,pef,dpf->d", parts, metric, parts, optimize=True)


def _within(smallest: Vector, own: float) -> float:
    return float(np.searchsorted(smallest, own, side="right") / len(smallest)) if own else 0.0


def _tail(draws: Vector, values: Vector) -> Vector:
    """Fraction of the draws that are at least as large; beyond the largest, from a gamma
    distribution with the same mean and variance."""
    if not draws.any():  # all scores are 0
        return np.ones(len(values))
    ordered = np.sort(draws)
    part = 1.0 - np.searchsorted(ordered, values, side="left") / len(draws)
    mean, variance = float(draws.mean()), float(draws.var()) + 1e-30
    shape = mean**2 / variance
    return np.where(part > 5 / len(draws), part, gamma.sf(values, shape, scale=variance / mean))


def _scores(now: ModelFit, effect: Effect, of: NDArray[np.intp]) -> tuple[Array, Array]:
    """((b, p) scores of the effect's parameters, one row for each region; (p, p) inverse of their
    Fisher information). Both are computed without the effect, and the part that the rest of the
    model can explain is projected out."""
    wider = replace(now, model=now.model.with_patches_frozen().with_effect(effect))
    return scores(wider, jacobian_of(wider), of, len(effect.parameters))
