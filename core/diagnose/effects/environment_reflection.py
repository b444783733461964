"""The object mirrors its surroundings: a window, a softbox, a white wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..brdfs import BRDFs
from ..effect import Array, Effect, Numbers, Setting
from ..situation import Situation
from ..surroundings import ACCURACY

LOBES = 64  # directions that the surroundings are described by
SHARP = 21.0  # of each: half as bright 15° from its middle, which is about as far as the next


@dataclass(frozen=True)
class EnvironmentReflection(Effect):
    """numbers: how bright the surroundings are about each of ``directions`` (l, 3), radiance over
    the lamp's irradiance / π. reflected: (l, n, 3) of a radiance of 1 there."""

    directions: Array
    reflected: Array
    cause = "environment_reflection"
    of_brdf = True
    accuracy = ACCURACY
    proof = "one photo with the lamp off"

    @classmethod
    def of(cls, setting: Setting) -> EnvironmentReflection:
        around = setting.surroundings
        k = np.arange(LOBES)
        z, turn = 1 - (2 * k + 1) / LOBES, np.pi * (3 - np.sqrt(5)) * k
        r = np.sqrt(1 - z**2)
        directions = np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
        level = setting.own_level / np.pi
        open_ = (around.face < 0).astype(np.float32)
        reflected = []
        for d in directions.astype(np.float32):
            bright = np.exp(SHARP * (around.towards @ d - 1)) * open_
            reflected.append(level * around.under(bright))
        return cls(directions, np.stack(reflected))

    @property
    def numbers(self) -> Numbers:
        names = [f"({x:.1f}, {y:.1f}, {z:.1f})" for x, y, z in self.directions]
        return Numbers.alike(names, "of E/π", 0.2, 0.0, 20.0)

    def added(self, now: Situation, brdfs: BRDFs, x: np.ndarray) -> Array:
        return np.tensordot(x.astype(np.float32), self.reflected, 1)

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        bright = self.directions[int(np.argmax(x))]
        return (
            "the object mirrors its surroundings, brightest towards "
            f"({bright[0]:.1f}, {bright[1]:.1f}, {bright[2]:.1f}) of the scan's frame: "
            f"{100 * float(x.max()):.0f} % of the light a white wall under the lamp would send"
        )
