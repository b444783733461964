"""The forward model with effects in it: coefficients and numbers → what the photos show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .brdfs import BRDFs
from .effect import Effect
from .fixed import Fixed
from .footprint import CORNERS, Footprint, turned
from .pixels import Pixels
from .situation import Situation

Array = NDArray[np.floating]
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Lit:
    """now: surface and light with all effects; reflected: (n, 3) radiance of the lamp's light;
    slope: (n, 3) its ∂/∂ ln(ρ·cosMap + ε)."""

    now: Situation
    reflected: Array
    slope: Array


@dataclass(frozen=True)
class Model:
    """effects act in this order; x: the numbers of each. footprint: of the same pixels, given on
    from model to model."""

    pixels: Pixels
    brdfs: BRDFs
    effects: tuple[Effect, ...] = ()
    x: tuple[Vector, ...] = ()
    footprint: Footprint | None = None

    def __post_init__(self) -> None:
        if self.footprint is None:
            object.__setattr__(self, "footprint", Footprint(self.pixels))

    def with_effect(self, effect: Effect, x: Vector | None = None) -> Model:
        """One more effect, after the others; x: its numbers, None: where the search begins. Of
        effects with numbers for each of many patches one at a time is searched for: an earlier one
        stays as it was found."""
        before = self.settled() if effect.patch is not None else self
        return replace(
            before,
            brdfs=effect.loosened(self.brdfs),
            effects=(*before.effects, effect),
            x=(*before.x, effect.numbers.begin if x is None else x),
        )

    def settled(self) -> Model:
        """With the numbers of patches as they are: no longer searched for."""
        effects, x = list(self.effects), list(self.x)
        if self.patchy is not None:
            effects[self.patchy] = Fixed(effects[self.patchy], x[self.patchy])
            x[self.patchy] = np.zeros(0)
        return replace(self, effects=tuple(effects), x=tuple(x))

    @property
    def causes(self) -> list[str]:
        """Of the effects, whether their numbers are searched for or not."""
        return [e.inner.cause if isinstance(e, Fixed) else e.cause for e in self.effects]

    def place_of(self, cause: str) -> int:
        """Of the effect in the model."""
        return self.causes.index(cause)

    def is_settled(self, cause: str) -> bool:
        """Whether the effect's numbers are no longer searched for."""
        return isinstance(self.effects[self.place_of(cause)], Fixed)

    def numbers_of(self, cause: str) -> Vector:
        """(p,) of the effect."""
        place = self.place_of(cause)
        effect = self.effects[place]
        return effect.x if isinstance(effect, Fixed) else self.x[place]

    def without(self, cause: str) -> Array:
        """(n, 3) what the model shows without one of its effects, the BRDF the same: another BRDF
        would take much of it, as it takes the light that glare takes from all that is bright."""
        place, x = self.place_of(cause), self.numbers_of(cause)
        effects, numbers = list(self.effects), list(self.x)
        effect = effects[place]
        if isinstance(effect, Fixed):
            effects[place] = Fixed(effect.inner, x - effect.inner.told(x))
        else:
            numbers[place] = x - effect.told(x)
        return replace(self, effects=tuple(effects), x=tuple(numbers)).predicted()

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

    def lamps(self, now: Situation, x: Sequence[Vector] | None = None) -> list[Situation]:
        """The same for each of the equal parts of the lamp, where an effect gives it a size; each
        part then falls on another corner of the pixel."""
        parts = [now]
        for effect, numbers in zip(self.effects, self.x if x is None else x, strict=True):
            parts = [lamp for part in parts for lamp in effect.lamps(part, numbers)]
        if len(parts) == 1:
            return parts
        return [turned(part, k % len(CORNERS)) for k, part in enumerate(parts)]

    def rows(self, now: Situation) -> Array:
        """Q̂ (n, k): ∂ρ/∂c = (ρ + ε / cosMap) Q̂."""
        if now.moved:
            return self.brdfs.rows(now.angles)
        assert self.footprint is not None
        return self.footprint.plain_rows(self.brdfs, now)

    def mean(self, lamps: Sequence[Situation], of: Callable[[Situation], Array]) -> Array:
        """(n, d) means of ``of`` over the lamp's parts and the pixel's."""
        if len(lamps) > 1:
            return np.asarray(sum(of(now) for now in lamps) / len(lamps))
        assert self.footprint is not None
        out = of(lamps[0])
        out[self.footprint.wide] = self.footprint.mean(lamps[0], of)
        return out

    def reflected(self, lamps: Sequence[Situation]) -> Array:
        """(n, 3) radiance of the lamp's light."""
        return self.mean(lamps, self.brdfs.reflected)

    @cached_property
    def lit(self) -> Lit:
        """Of the model as it is."""
        now = self.situation()
        both = self.mean(self.lamps(now), self.brdfs.lit)
        return Lit(now, both[:, :3], both[:, 3:])

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
        if x is None:
            return self.shown(self.lit.now, self.lit.reflected)
        now = self.situation(x)
        reflected = self.reflected(self.lamps(now, x))
        return self.shown(now, reflected, x)

    def shown(self, now: Situation, reflected: Array, x: Sequence[Vector] | None = None) -> Array:
        """(n, 3) what the photos show where the surface reflects so much of the lamp's light."""
        return self.recorded(self.entering(reflected, now, x), now, x)
