"""One effect that was fitted together with a model, and its gain on held-out regions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effects.base.capabilities import JudgedByPixel
from ..effects.base.effect import Effect
from ..solver.model_fit import ModelFit
from .cross_validation import (
    HeldOutPrediction,
    parameter_variances_by_photo,
    standard_error_of_sum,
)

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

MAX_P_VALUE = 0.02  # probability of a false alarm, over all effects that are tried
MIN_RELATIVE_CHANGE = 0.005  # RMS change of the photos below which an effect is not reported,
LARGE_GAIN = 0.05  # nats a pixel and channel, unless it gains this much
MIN_STANDARD_ERRORS = 3.0  # of the gain over regions


@dataclass(frozen=True)
class Trial:
    """fitted: the model with the effect. held_out: its prediction of held-out regions.

    by_region: (b,) nats by which each held-out region is predicted better. change: RMS change of
    the prediction, relative. p_value: probability that chance explains the score, over all effects
    tried at once. ties: effects that explain the photos as well. contradicted_by: materials that a
    camera effect predicts worse, though a camera does the same to all of them.
    """

    effect: Effect
    fitted: ModelFit
    held_out: HeldOutPrediction
    by_region: Vector
    change: float
    p_value: float
    ties: tuple[Effect, ...] = ()
    contradicted_by: tuple[int, ...] = ()

    @property
    def gain(self) -> float:
        """Nats, over all held-out regions."""
        return float(self.by_region.sum())

    @property
    def error(self) -> float:
        """Standard error of the gain, over regions."""
        return standard_error_of_sum(self.by_region)

    @property
    def is_accepted(self) -> bool:
        """Whether the effect may be named."""
        relevant = self.effect.is_relevant(self.identified)
        return self.is_significant and relevant and not self.contradicted_by

    @property
    def is_significant(self) -> bool:
        """Whether it is more than chance, and large enough to be reported."""
        significant = self.gain > MIN_STANDARD_ERRORS * self.error and self.p_value < MAX_P_VALUE
        by_pixel = isinstance(self.effect, JudgedByPixel)
        relevant = by_pixel or self.effect.is_relevant(self.identified)
        large = self.gain > LARGE_GAIN * self.held_out.residual.size
        return significant and (self.change > MIN_RELATIVE_CHANGE or large) and relevant

    def sentence(self) -> str:
        """The effect in words, and the photos that would decide between it and its ties."""
        meaning = self.effect.sentence(self.identified, self.standard_errors)
        if not self.ties:
            return meaning
        others = " or ".join(effect.cause for effect in self.ties)
        photos = dict.fromkeys(effect.deciding_photo for effect in (self.effect, *self.ties))
        return (
            f"{meaning} The photos cannot distinguish this from {others}. This would decide: "
            f"{'; or '.join(photos)}."
        )

    def changed(self) -> Array:
        """(n, 3) radiance that the effect adds to the photos, the BRDFs unchanged."""
        without = self.fitted.model.predicted_without(self.effect.cause)
        return np.asarray(self.fitted.predicted - without)

    @property
    def x(self) -> Vector:
        """(p,) the effect's parameters."""
        return self.fitted.model.parameters_of(self.effect.cause)

    @property
    def identified(self) -> Vector:
        """(p,) the part of them that the photos determine."""
        return self.effect.identified(self.x)

    @property
    def standard_errors(self) -> Vector:
        """(p,) of that part."""
        place = self.fitted.model.place_of(self.effect.cause)
        return np.sqrt(np.maximum(self.held_out.variance[place], 0.0))

    def with_photo_errors(self) -> Trial:
        """The trial with standard errors that include errors common to a whole photo, and those of
        the effect's own approximations."""
        variance = list(parameter_variances_by_photo(self.fitted, self.held_out.variance))
        place = self.fitted.model.place_of(self.effect.cause)
        systematic = self.effect.systematic_errors(self.identified)
        variance[place] = variance[place] + np.square(systematic)
        return replace(self, held_out=replace(self.held_out, variance=tuple(variance)))
