"""The forward model with effects in it: coefficients and numbers → what the photos show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .brdfs import BRDFs
from .effect import Effect
from .fixed import Fixed
from .pixels import Pixels
from .situation import Situation

Array = NDArray[np.floating]
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """effects act in this order; x: the numbers of each. plain: rows of the basis at the directions
    that the capture says, kept: most effects leave them as they are."""

    pixels: Pixels
    brdfs: BRDFs
    effects: tuple[Effect, ...] = ()
    x: tuple[Vector, ...] = ()
    plain: dict[int, tuple[Array, Array]] = field(default_factory=dict)

    def with_effect(self, effect: Effect) -> Model:
        """One more effect, after the others. Of effects with numbers for each of many patches one
        at a time is searched for: an earlier one stays as it was found."""
        effects, x = list(self.effects), list(self.x)
        if effect.patch is not None:
            for k, other in enumerate(effects):
                if other.patch is not None:
                    effects[k], x[k] = Fixed(other, x[k]), np.zeros(0)
        return replace(
            self,
            brdfs=effect.loosened(self.brdfs),
            effects=(*effects, effect),
            x=(*x, effect.numbers.begin),
        )

    @property
    def everywhere(self) -> list[int]:
        """Places of the effects with few numbers."""
        return [k for k, e in enumerate(self.effects) if e.patch is None]

    @property
    def patchy(self) -> int | None:
        """Place of the effect with numbers for many patches, if there is one."""
        return next((k for k, e in enumerate(self.effects) if e.patch is not None), None)

    def feels(self, place: int) -> NDArray[np.intp]:
        """(n, s) which of an effect's numbers each pixel feels, −1 none: one a slot."""
        felt = self.effects[place].feels
        everything = np.arange(len(self.effects[place].numbers))
        return (
            np.broadcast_to(everything, (len(self.pixels), len(everything)))
            if felt is None
            else felt
        )

    def situation(self, x: Sequence[Vector] | None = None) -> Situation:
        """Surface and light with all effects, of a lamp that is a point."""
        now = Situation.of(self.pixels)
        for effect, numbers in zip(self.effects, self.x if x is None else x, strict=True):
            now = effect.before(now, numbers)
        return now

    def lamps(self, x: Sequence[Vector] | None = None) -> list[Situation]:
        """The same for each of the equal parts of the lamp, where an effect gives it a size."""
        parts = [self.situation(x)]
        for effect, numbers in zip(self.effects, self.x if x is None else x, strict=True):
            parts = [lamp for part in parts for lamp in effect.lamps(part, numbers)]
        return parts

    def rows(self, now: Situation) -> tuple[Array, Array]:
        """(Q̂ (n, k), cosMap (n,)): ∂ρ/∂c = (ρ + ε / cosMap) Q̂."""
        if now.moved:
            return self.brdfs.rows(now.angles)
        if 0 not in self.plain:
            self.plain[0] = self.brdfs.rows(now.angles)
        return self.plain[0]

    def reflected(self, lamps: Sequence[Situation]) -> Array:
        """(n, 3) radiance of the lamp's light."""
        material = self.pixels.material
        parts = (self.brdfs.evaluate(now.angles, material) * now.received for now in lamps)
        return np.asarray(sum(parts) / len(lamps))

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
        reflected = self.reflected(self.lamps(x))
        return self.recorded(self.entering(reflected, now, x), now, x)
