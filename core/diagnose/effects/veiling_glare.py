"""Light that scatters in the lens lies over the photo like a veil."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..effect import Array, Effect, Numbers, Setting
from ..situation import Situation


@dataclass(frozen=True)
class VeilingGlare(Effect):
    """numbers: the part of the light that scatters; it lands where the photo, blurred widely, is
    bright. veil: (n, 3) that blurred photo."""

    veil: Array
    cause = "veiling_glare"
    of_photo = True
    proof = "one photo with a hood on the lens and black behind the object"

    @classmethod
    def of(cls, setting: Setting) -> VeilingGlare:
        return cls(setting.pixels.veil)

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike(["part"], "", 0.1, 0.0, 0.6)

    def after(self, radiance: Array, now: Situation, x: np.ndarray) -> Array:
        return (1 - x[0]) * radiance + x[0] * self.veil

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        return (
            f"the lens scatters {100 * x[0]:.1f} % of the light over the photo (veiling glare): "
            "dark parts beside bright ones are too bright"
        )
