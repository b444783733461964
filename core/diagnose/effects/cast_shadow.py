"""Something that is not in the mesh cast a shadow: a tripod, a wall, what was not scanned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..dark_spots import dark_spots
from ..effect import Array, Near, Numbers, Setting
from ..model import Model
from ..patch_effect import PatchEffect
from ..patches import median_of
from ..situation import Situation

USUAL = 0.6
DARK = 0.2  # of the light, lost, from which a spot counts as shadowed


@dataclass(frozen=True)
class CastShadow(PatchEffect):
    """numbers: for each dark spot of a photo the part of the light that is lost there, negative.
    photo: (n,)."""

    photo: NDArray[np.int16]
    cause = "cast_shadow"
    proof = "a photo of everything that stands about the object, from the lamp"
    fine = True
    accuracy = 0.01  # pixels at the edge of a spot lose less

    @classmethod
    def of(cls, setting: Setting) -> CastShadow | None:
        pixels = setting.pixels
        spot = dark_spots(pixels, Model(pixels, setting.brdfs).predicted())
        return None if (spot < 0).all() else cls(spot, (USUAL,), pixels.photo)

    def elsewhere(self, setting: Setting, near: Near) -> CastShadow:
        return replace(self, parts=self.parts[near.photo], photo=self.photo[near.photo])

    @property
    def numbers(self) -> Numbers:
        names = [f"spot {k + 1}" for k in range(self.count)]
        alike = Numbers.alike(names, "of the light", 1.0, -1.0, 0.0, step=-1e-2)
        return replace(alike, deviation=self.deviation)

    def guess(self, missed: Array, shown: Array) -> np.ndarray:
        part = missed.sum(axis=1) / np.maximum(shown.sum(axis=1), 1e-30)
        return np.clip(median_of(self.parts, part), -1, 0)

    def worth(self, x: np.ndarray) -> bool:
        return bool((-x > DARK).any())

    def lost(self, x: np.ndarray) -> Array:
        """(n,) part of the light that does not arrive."""
        return -self.felt(x)[:, 0]

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        return replace(now, visible=now.visible * (1 - self.lost(x)).astype(np.float32))

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        dark = self.lost(x) > DARK
        count = np.bincount(self.photo, minlength=1)
        part = np.bincount(self.photo, dark, len(count)) / np.maximum(count, 1)
        worst = int(np.argmax(part))
        return (
            "something that the mesh does not hold cast a shadow on the object: "
            f"{100 * part[worst]:.2g} % of what photo {worst + 1} shows, in "
            f"{int(np.sum(part > 0))} of {int(np.sum(count > 0))} photos, {100 * -x.min():.0f} % "
            "of the light where it is darkest"
        )
