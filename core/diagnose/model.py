"""The forward model with effects in it: coefficients and numbers → what the photos show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .brdfs import BRDFs
from .effect import Effect
from .pixels import Pixels
from .situation import Situation

Array = NDArray[np.floating]
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """effects act in this order; x: the numbers of each."""

    pixels: Pixels
    brdfs: BRDFs
    effects: tuple[Effect, ...] = ()
    x: tuple[Vector, ...] = ()

    @property
    def usual(self) -> Vector:
        """(p,) deviations of the numbers of all effects, before a photo is seen."""
        return np.concatenate([e.numbers.deviation for e in self.effects] + [np.zeros(0)])

    def situation(self, x: Sequence[Vector] | None = None) -> Situation:
        """Surface and light with all effects."""
        now = Situation.of(self.pixels)
        for effect, numbers in zip(self.effects, self.x if x is None else x, strict=True):
            now = effect.before(now, numbers)
        return now

    def reflected(self, now: Situation) -> Array:
        """(n, 3) radiance of the lamp's light."""
        return self.brdfs.evaluate(now.angles, self.pixels.material) * now.received

    def entering(
        self, reflected: Array, now: Situation, x: Sequence[Vector] | None = None
    ) -> Array:
        """(n, 3) radiance that the camera receives."""
        total = reflected
        for effect, numbers in zip(self.effects, self.x if x is None else x, strict=True):
            added = effect.added(now, self.brdfs, numbers)
            if added is not None:
                total = total + added
        return total

    def recorded(self, radiance: Array, now: Situation, x: Sequence[Vector] | None = None) -> Array:
        """(n, 3) what the photos say of it."""
        for effect, numbers in zip(self.effects, self.x if x is None else x, strict=True):
            radiance = effect.after(radiance, now, numbers)
        return radiance

    def predicted(self, x: Sequence[Vector] | None = None) -> Array:
        """(n, 3) what the photos show."""
        now = self.situation(x)
        return self.recorded(self.entering(self.reflected(now), now, x), now, x)
