"""What the search of causes found: effects with their gains, and which of them are named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .effect import Effect
from .fitted import Fitted
from .held_out import Unseen, error_of_sum, variances_by_photos
from .leftover import Leftover
from .unseen_error import UnseenError

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

CHANCE = 0.02  # of a false alarm, over all effects that are tried
LEAST_CHANGE = 0.005  # RMS of the photos: less is not worth a word,
PLAIN = 0.05  # nats a pixel and channel, unless it gains this much
SURE = 3.0  # standard errors over squares that a gain is above 0
MINOR = 0.05  # of what accepted effects gained: less is more likely what their model lacks


@dataclass(frozen=True)
class Trial:
    """One effect added to a model. fitted: with it; unseen: its prediction of left-out squares.
    gain: nats that it predicts them better, by_block (b,) of each square; change: RMS of what it
    changes in the prediction, relative. chance: that all of it is chance, over all effects tried at
    once. ties: effects that explain the photos as well. against: materials that a camera could not
    tell from the others, and that are predicted worse with it."""

    effect: Effect
    fitted: Fitted
    unseen: Unseen
    by_block: Vector
    change: float
    chance: float
    ties: tuple[Effect, ...] = ()
    against: tuple[int, ...] = ()

    @property
    def gain(self) -> float:
        """Nats."""
        return float(self.by_block.sum())

    @property
    def error(self) -> float:
        """Standard error of the gain, over squares."""
        return error_of_sum(self.by_block)

    @property
    def convincing(self) -> bool:
        """Whether it may be named."""
        return self.sure and self.effect.worth(self.told) and not self.against

    @property
    def sure(self) -> bool:
        """Whether it is no chance, and may be named or stand for what has no name."""
        sure = self.gain > SURE * self.error and self.chance < CHANCE
        told = self.effect.fine or self.effect.worth(self.told)
        plain = self.gain > PLAIN * self.unseen.residual.size
        return sure and (self.change > LEAST_CHANGE or plain) and told

    def sentence(self) -> str:
        """What it means, and what photo would tell it from what explains the photos as well."""
        said = self.effect.sentence(self.told, self.deviation)
        if not self.ties:
            return said
        others = " or ".join(e.cause for e in self.ties)
        proofs = "; or ".join(dict.fromkeys(e.proof for e in (self.effect, *self.ties)))
        return f"{said}. The photos cannot tell it from {others}; this would: {proofs}"

    def changed(self) -> Array:
        """(n, 3) radiance that the effect adds to what the photos show, the BRDF the same."""
        return self.fitted.shown - self.fitted.model.without(self.effect.cause)

    @property
    def x(self) -> Vector:
        """The effect's numbers."""
        return self.fitted.model.numbers_of(self.effect.cause)

    @property
    def told(self) -> Vector:
        """The numbers without what the BRDF could as well have."""
        return self.effect.told(self.x)

    @property
    def deviation(self) -> Vector:
        """Of the numbers as they are told."""
        place = self.fitted.model.place_of(self.effect.cause)
        return np.sqrt(np.maximum(self.unseen.variance[place], 0.0))

    def by_photos(self) -> Trial:
        """With deviations that know what whole photos err by, and the effect's own sums."""
        variance = list(variances_by_photos(self.fitted, self.unseen.variance))
        place = self.fitted.model.place_of(self.effect.cause)
        variance[place] = variance[place] + np.square(self.effect.own_error(self.told))
        return replace(self, unseen=replace(self.unseen, variance=tuple(variance)))


@dataclass(frozen=True)
class Found:
    """accepted: what is missed most of the whole model first, with their numbers in it; the slack
    beside the basis last. rounds: what was fitted at each, best first; the last is the one that
    found nothing. before, after: the fits without and with those that are named. left: structure
    that these do not explain. error_before, error_after: of left-out parts and photos. expected:
    (n, 3) deviation before anything was fitted. doubted: causes that gain, and what speaks against
    them, in words: of those tried first that a material contradicts them, of the accepted that the
    second fit does not bear them out."""

    accepted: tuple[Trial, ...]
    rounds: tuple[tuple[Trial, ...], ...]
    before: Fitted
    after: Fitted
    unseen_before: Unseen
    unseen_after: Unseen
    left: Leftover
    error_before: UnseenError
    error_after: UnseenError
    expected: Array
    doubted: Mapping[str, str] = field(default_factory=dict)

    @property
    def ranked(self) -> list[Trial]:
        """What is accepted, then the rest of the first round, best first."""
        first = self.rounds[0] if self.rounds else ()
        named = {t.effect.cause for t in self.accepted}
        return [*self.accepted, *(t for t in first if t.effect.cause not in named)]

    @property
    def named(self) -> tuple[Trial, ...]:
        """The accepted that nothing speaks against."""
        return tuple(t for t in self.accepted if t.effect.cause not in self.doubted)

    @property
    def noted(self) -> tuple[Trial, ...]:
        """Those that something is to be said of."""
        return tuple(t for t in self.ranked if t in self.accepted or t.effect.cause in self.doubted)

    @property
    def causes(self) -> tuple[str, ...]:
        """That are named, by the words of the vocabulary; ``unknown`` for what is left of
        structure."""
        causes = tuple(trial.effect.cause for trial in self.named)
        return (*causes, "unknown") if self.unexplained else causes

    def sentence(self, trial: Trial) -> str:
        """What it means, and what speaks against it."""
        doubt = self.doubted.get(trial.effect.cause)
        said = trial.sentence()
        return said if doubt is None else f"{said}. But that is doubtful: {doubt}"

    @property
    def unexplained(self) -> bool:
        """Whether structure is left that no cause explains, and that is not merely what the model
        of an accepted one lacks."""
        gained = sum(trial.gain for trial in self.named)
        return self.left.convincing and self.left.gain > MINOR * gained
