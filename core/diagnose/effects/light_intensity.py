"""The lamp drifted, or an exposure is wrong: every photo has a brightness of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effect import Effect, Near, Numbers, Setting, felt_by, without_mean
from ..situation import Situation

USUAL = 0.1  # of the logarithm


@dataclass(frozen=True)
class LightIntensity(Effect):
    """numbers: ln of each photo's gain; what they have in common is the BRDF's, and the prior
    keeps their mean at 0. photo: (n,) place of each pixel's among ``photos``, their numbers."""

    photos: tuple[int, ...]
    photo: NDArray[np.intp]
    cause = "light_intensity"
    proof = "a grey card beside the object in every photo"

    @classmethod
    def of(cls, setting: Setting) -> LightIntensity | None:
        photos, place = np.unique(setting.pixels.photo, return_inverse=True)
        return cls(tuple(photos.tolist()), place.ravel()) if len(photos) > 1 else None

    def elsewhere(self, setting: Setting, near: Near) -> LightIntensity:
        return replace(self, photo=self.photo[near.photo])

    @property
    def numbers(self) -> Numbers:
        names = [f"photo {p + 1}" for p in self.photos]
        return Numbers.alike(names, "ln", USUAL, -1.5, 1.5)

    @property
    def feels(self) -> NDArray[np.intp]:
        return felt_by(self.photo, 1)

    @property
    def anchor(self) -> NDArray[np.float64]:
        return without_mean(len(self.photos), 1, 0)

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        gain = np.exp(x)[self.photo].astype(np.float32)
        return replace(now, irradiance=now.irradiance * gain[:, None])

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        gain = np.exp(x - x.mean())
        low, high = int(np.argmin(gain)), int(np.argmax(gain))
        return (
            "the light (or the exposure) changed between photos: photo "
            f"{self.photos[high] + 1} is {100 * (gain[high] - 1):+.0f} %, photo "
            f"{self.photos[low] + 1} {100 * (gain[low] - 1):+.0f} % against the mean"
        )
