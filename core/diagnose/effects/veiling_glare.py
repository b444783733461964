"""Light that scatters in the lens lies over the photo like a veil."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..effect import Array, Effect, Numbers, Setting
from ..situation import Situation


@dataclass(frozen=True)
class VeilingGlare(Effect):
    """numbers: the part of the light that scatters, and how much more of it stays about where the
    photo is bright than goes all over it (1: all of it, −1: none). veil: (n, 2, 3) the photo
    blurred widely, and its mean."""

    veil: Array
    cause = "veiling_glare"
    of_camera = True
    of_photo = True
    accuracy = 0.03  # the veil lies over the photo that it is taken from
    proof = "one photo with a hood on the lens and black behind the object"

    @classmethod
    def of(cls, setting: Setting) -> VeilingGlare:
        return cls(setting.pixels.veil)

    @property
    def numbers(self) -> Numbers:
        return Numbers(
            ("part", "nearness"), ("", ""), np.array([0.1, 0.5]), np.array([0.0, -1.0]),
            np.array([0.6, 1.0]), np.array([1e-3, 1e-2]),
        )  # fmt: skip

    @property
    def freedom(self) -> int:
        return 1

    def after(self, radiance: Array, now: Situation, x: np.ndarray) -> Array:
        about, even = 0.5 * (1 + x[1]), 0.5 * (1 - x[1])
        veil = about * self.veil[:, 0] + even * self.veil[:, 1]
        return (1 - x[0]) * radiance + x[0] * veil

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        return (
            f"the lens scatters {100 * x[0]:.1f} % of the light over the photo (veiling glare): "
            "dark parts beside bright ones are too bright"
        )
