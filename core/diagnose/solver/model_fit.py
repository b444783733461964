"""A model with its residuals and its cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...statistics.student_t import robust_cost
from ..effects.base.parameters import Parameters
from .model import Model

Array = NDArray[np.floating]
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class ModelFit:
    """model: at its optimum. deviation: (n, 3) standard deviation of every pixel, held constant.
    predicted: (n, 3). residual: (n, 3) photo minus prediction, in units of the deviation. cost: of
    the pixels, in nats, without the prior."""

    model: Model
    deviation: Array
    predicted: Array
    residual: Array
    cost: float

    @classmethod
    def of(cls, model: Model, deviation: Array) -> ModelFit:
        """The residuals of a model at its present parameters."""
        predicted = model.predicted()
        residual = (model.pixels.observed - predicted) / deviation
        return cls(model, deviation, predicted, residual, float(robust_cost(residual).sum()))

    def joined(self, what: Callable[[Parameters], Vector]) -> Vector:
        """(p,) a property of the parameters of all global effects, one effect after the other."""
        effects = self.model.effects
        each = [what(effects[k].parameters) for k in self.model.global_places]
        return np.concatenate([*each, np.zeros(0)])

    @property
    def parameters(self) -> Vector:
        """(p,) values of the same parameters."""
        return np.concatenate([*(self.model.x[k] for k in self.model.global_places), np.zeros(0)])

    @property
    def identified(self) -> Vector:
        """(p,) the same without what the BRDF can absorb, which the prior does not constrain: the
        gain of a held-out photo is the mean of all gains."""
        model = self.model
        each = [model.effects[k].identified(model.x[k]) for k in model.global_places]
        return np.concatenate([*each, np.zeros(0)])

    @property
    def total_cost(self) -> float:
        """The cost with the prior, in nats."""
        model = self.model
        prior = float(np.sum(model.brdfs.coefficients**2 / model.brdfs.variance))
        for place, (effect, x) in enumerate(zip(model.effects, model.x, strict=True)):
            if place not in model.frozen:
                identified = effect.identified(x)
                prior += float(np.sum((identified / effect.parameters.deviation) ** 2))
        return self.cost + 0.5 * prior
