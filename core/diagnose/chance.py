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

from ..job.in_order import in_order
from .effect import Effect
from .fitted import Fitted
from .scores import scores
from .slopes import slopes_of

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

DRAWS = 2000


@dataclass(frozen=True)
class Asked:
    """effect; gain: nats that a step along its numbers promises; chance: that all of it is chance,
    over all effects asked at once."""

    effect: Effect
    gain: float
    chance: float


def asked(
    now: Fitted, effects: Sequence[Effect], pool: ThreadPoolExecutor | None = None
) -> list[Asked]:
    """Of the model without any of them, best first. pool: threads that ask side by side."""
    _, of = np.unique(now.model.pixels.block, return_inverse=True)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (DRAWS, int(of.max()) + 1))

    def ask(effect: Effect) -> tuple[Asked, Vector | None]:
        tries = [ask_from(one) for one in effect.beginnings]
        best, draws = max(tries, key=lambda each: each[0].gain)
        return replace(best, chance=min(1.0, best.chance * len(tries))), draws

    def ask_from(effect: Effect) -> tuple[Asked, Vector | None]:
        if not len(effect.numbers) or effect.fine:  # signs of squares tell nothing of single pixels
            return Asked(effect, np.inf, 0.0), None
        pulls, metric = _scores(now, effect, of)
        draws = _length(signs @ pulls, metric)
        value = float(_length(pulls.sum(axis=0)[None], metric)[0])
        promised = (value - float(draws.mean())) / 2  # beyond what chance gives
        return Asked(effect, promised, float(_tail(draws, np.array([value]))[0])), draws

    answers = list(in_order(pool, ask, effects, ahead=len(effects)))
    found, drawn = [a for a, _ in answers], [d for _, d in answers if d is not None]
    if drawn:
        # each effect's own distribution makes effects of different freedom comparable
        luckiest = np.sort(np.min([_tail(d, d) for d in drawn], axis=0))
        found = [replace(a, chance=max(a.chance, _within(luckiest, a.chance))) for a in found]
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


def _scores(now: Fitted, effect: Effect, of: NDArray[np.intp]) -> tuple[Array, Array]:
    """((b, p) each square's pull on the effect's numbers beyond what the rest of the model takes,
    (p, p) inverse of their information), at the model without the effect."""
    wider = replace(now, model=now.model.settled().with_effect(effect))
    return scores(wider, slopes_of(wider), of, len(effect.numbers))
