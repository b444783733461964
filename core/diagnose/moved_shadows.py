"""Shadows that move with the lamp: where light grazes the object, by more than the lamp does."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .effect import Array, Effect, Setting
from .part_lit import part_lit, parts_of
from .situation import Situation


@dataclass(frozen=True)
class MovedShadows:
    """more: (n,) part of the light that arrives where an effect with numbers x (p,) puts the lamp,
    less what arrives from where the capture does."""

    x: NDArray[np.float64]
    more: Array

    @classmethod
    def of(cls, setting: Setting, effect: Effect, x: NDArray[np.float64]) -> MovedShadows:
        """effect: without shadows of its own."""
        pixels = setting.pixels
        towards = effect.before(Situation.of(pixels), x).light
        # of both in one way: what rays from parts of a pixel miss of a fold is the same
        parts = parts_of(setting.rays, pixels)
        was, will = (
            part_lit(setting.rays, pixels, to, parts=parts) for to in (pixels.light, towards)
        )
        return cls(x, will - was)

    def on(self, now: Situation) -> Situation:
        """With these shadows."""
        visible = np.clip(now.visible + self.more, 0, 1).astype(np.float32)
        return replace(now, visible=visible)
