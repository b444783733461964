"""The lamp was near: its direction and irradiance differ over the object."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effect import Array, Effect, Near, Numbers, Setting, felt_by, without_mean
from ..moved_shadows import MovedShadows
from ..situation import Situation
from .light_direction import LightDirection

USUAL = 0.3  # sizes of the object over the distance
NEAREST = 1.2  # the lamp is not within the object: sizes of it from the centre
ASIDE, BRIGHTER = np.radians(1.0), 0.05  # what may be measured elsewhere than at the centre
EACH = 4
START = 0.15  # of the nearness: away from its bound, where steps are cut short


@dataclass(frozen=True)
class NearLight(Effect):
    """numbers: for each distant light the object's size over the lamp's distance, then two angles
    and ln of a gain: where direction and irradiance were measured, a near lamp's are others than at
    the object's centre. from_afar: the same lights as distant ones; offset: (n, 3) from the centre,
    in sizes. shadows: of where the lamps were found to be."""

    from_afar: LightDirection
    offset: Array
    size: float
    shadows: MovedShadows | None = None
    cause = "near_light"
    proof = "the same photos with the lamp twice as far away"

    @classmethod
    def of(cls, setting: Setting) -> NearLight | None:
        from_afar = LightDirection.of(setting)
        if from_afar is None:
            return None
        return cls(from_afar, _offset(setting), setting.size)

    def elsewhere(self, setting: Setting, near: Near) -> NearLight:
        from_afar = self.from_afar.elsewhere(setting, near)
        found = replace(self, from_afar=from_afar, offset=_offset(setting), shadows=None)
        return found if self.shadows is None else found.casting(setting, self.shadows.x)

    @property
    def numbers(self) -> Numbers:
        names, units = [], []
        for light in self.from_afar.names:
            names += [f"{light}, {what}" for what in ("nearness", "first", "second", "gain")]
            units += ["size / distance", "rad", "rad", "ln"]
        count = len(self.from_afar.names)
        return Numbers(
            tuple(names), tuple(units),
            np.tile([USUAL, ASIDE, ASIDE, BRIGHTER], count),
            np.tile([0.0, -0.2, -0.2, -0.5], count),
            np.tile([1 / NEAREST, 0.2, 0.2, 0.5], count),
            np.full(EACH * count, 1e-3),
            np.tile([START, 0.0, 0.0, 0.0], count),
        )  # fmt: skip

    @property
    def feels(self) -> NDArray[np.intp]:
        return felt_by(self.from_afar.light, EACH)

    @property
    def anchor(self) -> NDArray[np.float64]:
        return without_mean(len(self.from_afar.names), EACH, EACH - 1)

    def nearness(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(lights,) sizes of the object over the distance."""
        return x[::EACH]

    def casting(self, setting: Setting, x: np.ndarray) -> NearLight:
        return replace(self, shadows=MovedShadows.of(setting, replace(self, shadows=None), x))

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        now = now if self.shadows is None else self.shadows.on(now)
        angles = np.stack([x[1::EACH], x[2::EACH]], axis=1).ravel()
        now = self.from_afar.before(now, angles)
        light = self.from_afar.light
        # a lamp at light / nearness, in sizes: seen from a point it is at light − nearness · offset
        inverse = np.where(light >= 0, x[::EACH][light], 0.0).astype(np.float32)
        gain = np.where(light >= 0, np.exp(x[3::EACH])[light], 1.0).astype(np.float32)
        towards = now.light - inverse[:, None] * self.offset
        length = np.linalg.norm(towards, axis=1, keepdims=True)
        irradiance = now.irradiance * gain[:, None] / length**2
        return replace(now, light=towards / length, irradiance=irradiance)

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        nearest = int(np.argmax(self.nearness(x)))
        nearness = max(float(self.nearness(x)[nearest]), 1e-9)
        half = min(nearness / 2, 0.9)
        unevenness = 100 * (((1 + half) / (1 - half)) ** 2 - 1)
        return (
            f"the lamp ({self.from_afar.names[nearest]}) stood near, about "
            f"{self.size / nearness:.3g} scan units away ({1 / nearness:.1f} times the object's "
            f"size): the near side gets up to {unevenness:.0f} % more light than the far one"
        )


def _offset(setting: Setting) -> Array:
    """(n, 3) from the centre, in sizes."""
    return ((setting.pixels.point - setting.centre) / setting.size).astype(np.float32)
