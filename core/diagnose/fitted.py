"""A model with its residuals, and what they cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .effect import Numbers
from .model import Model

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

DEGREES = 4.0  # of freedom of the Student t


@dataclass(frozen=True)
class Fitted:
    """model at its optimum. deviation: (n, 3) of every pixel, fixed; shown: (n, 3) the prediction;
    residual: (n, 3) what photos show more, in units of the deviation. cost: of the pixels, in nats,
    the prior not counted."""

    model: Model
    deviation: Array
    shown: Array
    residual: Array
    cost: float

    @classmethod
    def of(cls, model: Model, deviation: Array) -> Fitted:
        """A model as it is."""
        shown = model.predicted()
        residual = (model.pixels.observed - shown) / deviation
        return cls(model, deviation, shown, residual, float(robust(residual).sum()))

    def joined(self, what: Callable[[Numbers], Vector]) -> Vector:
        """(p,) of the numbers of all effects with few of them, one after the other."""
        effects = self.model.effects
        each = [what(effects[k].numbers) for k in self.model.everywhere]
        return np.concatenate([*each, np.zeros(0)])

    @property
    def numbers(self) -> Vector:
        """(p,) the same effects' numbers."""
        return np.concatenate([*(self.model.x[k] for k in self.model.everywhere), np.zeros(0)])

    @property
    def told(self) -> Vector:
        """(p,) the same without what the BRDF could as well have, which no prior speaks of: the
        gain of a photo that is left out is what all gains have in common."""
        model = self.model
        each = [model.effects[k].told(model.x[k]) for k in model.everywhere]
        return np.concatenate([*each, np.zeros(0)])

    @property
    def whole(self) -> float:
        """The cost with the prior's."""
        brdfs = self.model.brdfs
        prior = float(np.sum(brdfs.coefficients**2 / brdfs.variance))
        for effect, x in zip(self.model.effects, self.model.x, strict=True):
            prior += float(np.sum((effect.told(x) / effect.numbers.deviation) ** 2))
        return self.cost + 0.5 * prior


def robust(residual: Array) -> Array:
    """Cost of residuals in units of their deviation, nats (Student t)."""
    return (DEGREES + 1) / 2 * np.log1p(np.square(residual) / DEGREES)


def weights(residual: Array) -> Array:
    """Of the residuals' squares in Gauss–Newton."""
    return (DEGREES + 1) / (DEGREES + np.square(residual))
