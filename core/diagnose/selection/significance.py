"""What the photos ask of every effect, before it is fitted, and how likely chance would ask it.

The pull on an effect's numbers is summed over squares of the photos. Squares are what is
independent: turning the sign of whole squares' pulls at random (the wild cluster bootstrap:
Cameron, Gelbach & Miller 2008, "Bootstrap-based improvements for inference with clustered errors")
shows what chance does, for all effects tried at once, so that many tries do not make a false alarm
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

DRAWS = 2000


@dataclass(frozen=True)
class Candidate:
    """effect; gain: nats that a step along its numbers promises; chance: that all of it is chance,
    over all effects asked at once."""

    effect: Effect
    gain: float
    p_value: float


def rank_candidates(
    now: ModelFit, effects: Sequence[Effect], pool: ThreadPoolExecutor | None = None
) -> list[Candidate]:
    """Of the model without any of them, best first. pool: threads that ask side by side."""
    _, of = np.unique(now.model.pixels.block, return_inverse=True)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (DRAWS, int(of.max()) + 1))

    def ask(effect: Effect) -> tuple[Candidate, Vector | None]:
        tries = [ask_from(one) for one in effect.starts]
        best, draws = max(tries, key=lambda each: each[0].gain)
        return replace(best, p_value=min(1.0, best.p_value * len(tries))), draws

    def ask_from(effect: Effect) -> tuple[Candidate, Vector | None]:
        by_pixel = isinstance(effect, JudgedByPixel)  # which the signs of regions do not test
        if by_pixel or not len(effect.parameters):
            return Candidate(effect, np.inf, 0.0), None
        pulls, metric = _scores(now, effect, of)
        draws = _length(signs @ pulls, metric)
        value = float(_length(pulls.sum(axis=0)[None], metric)[0])
        promised = (value - float(draws.mean())) / 2  # beyond what chance gives
        return Candidate(effect, promised, float(_tail(draws, np.array([value]))[0])), draws

    answers = list(ordered_map(pool, ask, effects, ahead=len(effects)))
    found, drawn = [a for a, _ in answers], [d for _, d in answers if d is not None]
    if drawn:
        # each effect's own distribution makes effects of different freedom comparable
        luckiest = np.sort(np.min([_tail(d, d) for d in drawn], axis=0))
        found = [replace(a, p_value=max(a.p_value, _within(luckiest, a.p_value))) for a in found]
    return sorted(found, key=lambda a: -a.gain)


def _length(pull: Array, metric: Array) -> Vector:
    """(d,) squares of pulls (d, P · e) under a metric (P, e, e)."""
    parts = pull.reshape(len(pull), *metric.shape[:2])
    return np.einsum("dpe,pef,dpf->d", parts, metric, parts, optimize=True)


def _within(luckiest: Vector, own: float) -> float:
    return float(np.searchsorted(luckiest, own, side="right") / len(luckiest)) if own else 0.0


def _tail(draws: Vector, values: Vector) -> Vector:
    """Part of the draws that is at least as large; beyond the largest, a gamma distribution's."""
    if not draws.any():  # nothing pulls at all
        return np.ones(len(values))
    ordered = np.sort(draws)
    part = 1.0 - np.searchsorted(ordered, values, side="left") / len(draws)
    mean, variance = float(draws.mean()), float(draws.var()) + 1e-30
    shape = mean**2 / variance
    return np.where(part > 5 / len(draws), part, gamma.sf(values, shape, scale=variance / mean))


def _scores(now: ModelFit, effect: Effect, of: NDArray[np.intp]) -> tuple[Array, Array]:
    """((b, p) each square's pull on the effect's numbers beyond what the rest of the model takes,
    (p, p) inverse of their information), at the model without the effect."""
    wider = replace(now, model=now.model.with_patches_frozen().with_effect(effect))
    return scores(wider, jacobian_of(wider), of, len(effect.parameters))
