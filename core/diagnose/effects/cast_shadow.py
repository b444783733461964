"""Something that is not in the mesh cast a shadow: a tripod, a wall, what was not scanned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effect import Array, Near, Numbers, Setting
from ..image_cells import cell_numbers
from ..patch_effect import PatchEffect
from ..patches import median_of
from ..situation import Situation

ACROSS = 14  # squares along a photo's longer side in which the shadow is described
USUAL = 0.4
LEAST = 0.0012  # of all squares that are shadowed
DARK = 0.3  # of the light, lost, from which a square counts as shadowed


@dataclass(frozen=True)
class CastShadow(PatchEffect):
    """numbers: for each small square of each photo the part of the light that is lost there,
    negative. photo: (n,)."""

    photo: NDArray[np.int16]
    cause = "cast_shadow"
    proof = "a photo of everything that stands about the object, from the lamp"
    fine = True
    credit = 0.6

    @classmethod
    def of(cls, setting: Setting) -> CastShadow:
        pixels = setting.pixels
        number = cell_numbers(pixels.photo, pixels.x, pixels.y, ACROSS)
        square = np.unique(number, return_inverse=True)[1].ravel()
        return cls(square.astype(np.intp), (USUAL,), pixels.photo)

    def elsewhere(self, setting: Setting, near: Near) -> CastShadow:
        return replace(self, parts=self.parts[near.photo], photo=self.photo[near.photo])

    @property
    def numbers(self) -> Numbers:
        names = [f"square {k + 1}" for k in range(self.count)]
        alike = Numbers.alike(names, "of the light", 1.0, -1.0, 0.0, step=-1e-2)
        return replace(alike, deviation=self.deviation)

    @property
    def freedom(self) -> int:
        return 10 * len(self.numbers)  # each photo has its own: nothing is as free

    def guess(self, missed: Array, shown: Array) -> np.ndarray:
        part = missed.sum(axis=1) / np.maximum(shown.sum(axis=1), 1e-30)
        less = np.minimum(median_of(self.parts, part), 0)
        return np.where(less < -DARK, np.maximum(less, -1), 0.0)

    def worth(self, x: np.ndarray) -> bool:
        return bool(np.mean(-x > DARK) > LEAST)

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
            f"{100 * part[worst]:.0f} % of what photo {worst + 1} shows, in "
            f"{int(np.sum(part > 0.01))} of {int(np.sum(count > 0))} photos"
        )
