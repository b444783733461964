"""The room was not dark: light came from everywhere, not from the lamp alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..brdfs import BRDFs
from ..effect import Array, Effect, Numbers, Setting
from ..situation import Situation
from ..surroundings import ACCURACY


@dataclass(frozen=True)
class AmbientLight(Effect):
    """numbers: radiance of the room over the lamp's irradiance / π, red, green, blue. reflected:
    (n, 3) of a room of that radiance 1, where the object does not hide it."""

    reflected: Array
    cause = "ambient_light"
    of_brdf = True
    accuracy = ACCURACY
    proof = "one photo with the lamp off"

    @classmethod
    def of(cls, setting: Setting) -> AmbientLight:
        around = setting.surroundings
        level = setting.own_level / np.pi
        return cls(level * around.under(around.open.astype(np.float32)))

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike(["red", "green", "blue"], "of E/π", 0.1, 0.0, 2.0)

    def added(self, now: Situation, brdfs: BRDFs, x: np.ndarray) -> Array:
        return self.reflected * x

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        return (
            "the room was not dark: light from all around reached the object, "
            f"{100 * float(np.mean(x)):.1f} % of what the lamp gives a surface that faces it"
        )
