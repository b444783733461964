"""The lamps stood elsewhere than the capture says: each direction is off by two angles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ..effect import Array, Effect, Near, Numbers, Setting, felt_by
from ..moved_shadows import MovedShadows
from ..situation import Situation

USUAL = np.radians(3.0)
FARTHEST = np.radians(25.0)


@dataclass(frozen=True)
class LightDirection(Effect):
    """numbers: for each distant light the tangents of two angles, radians, about ``aside`` and
    ``other``, (lights, 3) unit vectors across its direction. light: (n,) of each pixel, −1 for
    one that is not distant. shadows: of where the lamps were found to be."""

    names: tuple[str, ...]
    aside: Array
    other: Array
    light: NDArray[np.intp]
    shadows: MovedShadows | None = None
    cause = "light_direction"
    proof = "a mirror ball beside the object in one photo under each light"
    accuracy = 0.02  # facets of a mesh on which it grazes, and shadows cast away from where it was

    @classmethod
    def of(cls, setting: Setting) -> LightDirection | None:
        pixels = setting.pixels
        wanted = [k for k in range(len(setting.lights)) if setting.distant[k]]
        number = setting.light[pixels.photo]
        wanted = [k for k in wanted if (number == k).any()]
        if not wanted:
            return None
        directions, place = np.empty((len(wanted), 3)), np.full(len(pixels), -1)
        for i, k in enumerate(wanted):
            place[number == k] = i
            directions[i] = pixels.light[np.flatnonzero(number == k)[0]]
        names = tuple(setting.lights[k] for k in wanted)
        return cls(names, *tangents(directions), place)

    def elsewhere(self, setting: Setting, near: Near) -> LightDirection:
        found = replace(self, light=self.light[near.photo], shadows=None)
        return found if self.shadows is None else found.casting(setting, self.shadows.x)

    @property
    def numbers(self) -> Numbers:
        names = [f"{name}, {way}" for name in self.names for way in ("first", "second")]
        return Numbers.alike(names, "rad", USUAL, -FARTHEST, FARTHEST)

    @property
    def feels(self) -> NDArray[np.intp]:
        return felt_by(self.light, 2)

    def casting(self, setting: Setting, x: np.ndarray) -> LightDirection:
        return replace(self, shadows=MovedShadows.of(setting, replace(self, shadows=None), x))

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        now = now if self.shadows is None else self.shadows.on(now)
        moved = x[0::2, None] * self.aside + x[1::2, None] * self.other
        light = now.light + np.where(self.light[:, None] >= 0, moved[self.light], 0.0)
        light /= np.linalg.norm(light, axis=1, keepdims=True)
        return replace(now, light=light.astype(np.float32))

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        angle = np.degrees(np.arctan(np.hypot(x[0::2], x[1::2])))
        said = ", ".join(f"{n} by {a:.1f}°" for n, a in zip(self.names, angle, strict=True))
        return f"the light came from elsewhere than the capture says: {said}"
