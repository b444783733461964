"""Which effects the photos ask for: tried one by one, the best accepted, then looked again.

An effect is judged by what the model with it predicts better of squares that neither was fitted to
(held_out.py). Squares are what is independent: whether a gain could be chance is asked by turning
the sign of whole squares' residuals at random (the wild cluster bootstrap: Cameron, Gelbach &
Miller 2008, "Bootstrap-based improvements for inference with clustered errors"), for all effects
tried at once, so that many tries do not make a false alarm likely.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .deviation import NORMAL, as_found
from .effect import Effect
from .equations import scores
from .fitted import Fitted
from .held_out import Unseen, predict_unseen
from .model import Model
from .slopes import slopes_of
from .solve import fit

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

DRAWS = 2000
CHANCE = 0.02  # of a false alarm, over all effects that are tried
LEAST_CHANGE = 0.003  # RMS of the photos: less is not worth a word
MOST_EFFECTS = 4
SURE = 3.0  # standard errors over squares that a gain is above 0
NEARLY = 0.93  # of the best gain


@dataclass(frozen=True)
class Trial:
    """One effect added to a model. fitted: with it; unseen: its prediction of left-out squares.
    gain: nats that it predicts them better; error: standard error of that over squares. change: RMS
    of what it changes in the prediction, relative. chance: that all of it is chance, over all
    effects tried at once."""

    effect: Effect
    fitted: Fitted
    unseen: Unseen
    gain: float
    error: float
    change: float
    chance: float = 1.0

    @property
    def x(self) -> Vector:
        """The effect's numbers."""
        return self.fitted.model.x[-1]

    @property
    def deviation(self) -> Vector:
        """Of the numbers, as the curvature says."""
        p = len(self.effect.numbers)
        return np.sqrt(np.diag(self.unseen.covariance)[-p:])


@dataclass(frozen=True)
class Found:
    """accepted: in the order of acceptance. rounds: what was tried at each, best first; the last is
    the one that found nothing. before, after: the fits without and with all accepted. not_noise:
    part of the residual's variance that its pixels' deviations do not account for."""

    accepted: tuple[Trial, ...]
    rounds: tuple[tuple[Trial, ...], ...]
    before: Fitted
    after: Fitted
    unseen_before: Unseen
    unseen_after: Unseen
    not_noise_before: float
    not_noise_after: float

    @property
    def ranked(self) -> list[Trial]:
        """What is accepted, then the rest of the first round, best first."""
        first = self.rounds[0] if self.rounds else ()
        return [*self.accepted, *(t for t in first if t.effect.cause not in self.causes)]

    @property
    def causes(self) -> tuple[str, ...]:
        """By the words of the vocabulary, in the order of acceptance."""
        return tuple(trial.effect.cause for trial in self.accepted)


def search(
    model: Model, deviation: Array, effects: Sequence[Effect]
) -> Generator[float, None, Found]:
    """Yields the fraction done."""
    now = fit(model, deviation)
    expected = deviation
    deviation = as_found(deviation, now.residual, now.shown, model.pixels)
    now = before = fit(now.model, deviation)
    unseen = unseen_before = predict_unseen(before)
    accepted: list[Trial] = []
    rounds: list[tuple[Trial, ...]] = []
    left = list(effects)
    for turn in range(MOST_EFFECTS):
        trials = []
        for place, effect in enumerate(left):
            yield (turn + place / max(len(left), 1)) / MOST_EFFECTS
            trials.append(_try(now, unseen, effect))
        trials = _with_chances(now, trials)
        trials.sort(key=lambda t: -t.gain)
        rounds.append(tuple(trials))
        best = _simplest([t for t in trials if _convincing(t)])
        if best is None:
            break
        accepted.append(best)
        now, unseen = best.fitted, best.unseen
        left = [e for e in left if e is not best.effect]
    return Found(
        tuple(accepted), tuple(rounds), before, now, unseen_before, unseen,
        _not_noise(before, expected), _not_noise(now, expected),
    )  # fmt: skip


def _not_noise(fitted: Fitted, expected: Array) -> float:
    """Of the residual's variance; expected: (n, 3) deviation before anything was seen."""
    residual = fitted.residual * fitted.deviation / expected
    scale = float(np.median(np.abs(residual[np.isfinite(residual)]))) / NORMAL
    return max(0.0, 1.0 - 1.0 / max(scale, 1e-9) ** 2)


def _simplest(trials: Sequence[Trial]) -> Trial | None:
    """Of convincing trials, best first, the one with the fewest numbers that gains nearly as much
    as the best: sixteen spots of light can stand for an even room, which is one thing."""
    if not trials:
        return None
    enough = [t for t in trials if t.gain > NEARLY * trials[0].gain]
    return min(enough, key=lambda t: len(t.effect.numbers))


def _convincing(trial: Trial) -> bool:
    return trial.gain > SURE * trial.error and trial.chance < CHANCE and trial.change > LEAST_CHANGE


def _try(now: Fitted, unseen: Unseen, effect: Effect) -> Trial:
    model = now.model
    wider = replace(model, effects=(*model.effects, effect), x=(*model.x, effect.numbers.begin))
    fitted = fit(wider, now.deviation)
    predicted = predict_unseen(fitted)
    gains = unseen.cost - predicted.cost
    by_block = np.bincount(model.pixels.block, gains)
    counted = np.isfinite(now.deviation).all(axis=1)
    shown = fitted.shown[counted]
    change = np.sqrt(np.sum((shown - now.shown[counted]) ** 2) / max(np.sum(shown**2), 1e-30))
    spread = np.sqrt(np.sum((by_block - by_block.sum() / len(by_block)) ** 2))
    return Trial(effect, fitted, predicted, float(gains.sum()), float(spread), float(change))


def _with_chances(now: Fitted, trials: Sequence[Trial]) -> list[Trial]:
    """How likely chance would have made any effect look as convincing as each."""
    if not trials:
        return []
    block = now.model.pixels.block
    _, of = np.unique(block, return_inverse=True)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (DRAWS, int(of.max()) + 1))
    observed, drawn = [], []
    for trial in trials:
        pulls, inverse = _scores(now, trial.effect, of)
        total = pulls.sum(axis=0)
        observed.append(float(total @ inverse @ total))
        draws = signs @ pulls
        drawn.append(np.einsum("dp,pq,dq->d", draws, inverse, draws))
    # each effect's own distribution makes effects of different freedom comparable
    ranks = np.stack([_tail(d, d) for d in drawn], axis=1)
    luckiest = np.sort(ranks.min(axis=1))
    out = []
    for trial, value, draws in zip(trials, observed, drawn, strict=True):
        own = float(_tail(draws, np.array([value]))[0])
        chance = float(np.searchsorted(luckiest, own, side="right") / DRAWS)
        out.append(replace(trial, chance=max(chance, own)))
    return out


def _tail(draws: Vector, values: Vector) -> Vector:
    """Part of the draws that is at least as large; beyond the largest, a gamma distribution's."""
    from scipy.stats import gamma

    ordered = np.sort(draws)
    part = 1.0 - np.searchsorted(ordered, values, side="left") / len(draws)
    mean, variance = float(draws.mean()), float(draws.var()) + 1e-30
    shape = mean**2 / variance
    return np.where(part > 5 / len(draws), part, gamma.sf(values, shape, scale=variance / mean))


def _scores(now: Fitted, effect: Effect, of: NDArray[np.intp]) -> tuple[Array, Array]:
    """((b, p) each square's pull on the effect's numbers beyond what the rest of the model takes,
    (p, p) inverse of their information), at the model without the effect."""
    model = now.model
    start = effect.numbers.begin
    wider = Fitted(
        replace(model, effects=(*model.effects, effect), x=(*model.x, start)),
        now.deviation, now.shown, now.residual, now.cost,
    )  # fmt: skip
    return scores(wider, slopes_of(wider), of, len(effect.numbers))
