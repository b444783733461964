"""The lamp was near: its direction and irradiance differ over the object."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..effect import Array, Effect, Numbers, Setting
from ..situation import Situation

USUAL = 0.3  # sizes of the object over the distance
NEAREST = 1.2  # the lamp is not within the object: sizes of it from the centre


@dataclass(frozen=True)
class NearLight(Effect):
    """numbers: for each distant light the object's size over the lamp's distance from ``centre``
    (3,). light: (n,) of each pixel, −1 for one that is not distant. Irradiance is what the capture
    says at the centre."""

    names: tuple[str, ...]
    light: Array
    offset: Array
    size: float
    cause = "near_light"

    @classmethod
    def of(cls, setting: Setting) -> NearLight | None:
        pixels = setting.pixels
        number = setting.light[pixels.photo]
        wanted = [k for k in range(len(setting.lights)) if setting.distant[k]]
        wanted = [k for k in wanted if (number == k).any()]
        if not wanted:
            return None
        place = np.full(len(pixels), -1)
        for i, k in enumerate(wanted):
            place[number == k] = i
        offset = ((pixels.point - setting.centre) / setting.size).astype(np.float32)
        return cls(tuple(setting.lights[k] for k in wanted), place, offset, setting.size)

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike(self.names, "size / distance", USUAL, 0.0, 1 / NEAREST)

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        # lamp at light/x, in sizes; towards it from a point: light − x · offset, times 1/x
        inverse = np.where(self.light >= 0, x[self.light], 0.0).astype(np.float32)
        towards = now.light - inverse[:, None] * self.offset
        length = np.linalg.norm(towards, axis=1, keepdims=True)
        return replace(now, light=towards / length, irradiance=now.irradiance / length**2)

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        nearest = int(np.argmax(x))
        nearness = max(float(x[nearest]), 1e-9)
        unevenness = 100 * ((1 + nearness / 2) ** 2 / (1 - min(nearness, 1.9) / 2) ** 2 - 1)
        return (
            f"the lamp ({self.names[nearest]}) stood near, about {self.size / nearness:.3g} scan "
            f"units away ({1 / nearness:.1f} times the object's size): the near side gets up to "
            f"{unevenness:.0f} % more light than the far one"
        )
