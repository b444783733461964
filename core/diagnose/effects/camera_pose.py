"""Photos are not where the scan says: what they show is shifted and turned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effect import Array, Effect, Near, Numbers, Setting, felt_by
from ..situation import Situation

USUAL = 1.0  # pixels


@dataclass(frozen=True)
class CameraPose(Effect):
    """numbers: for each photo a shift to the right and down, and a turn, in pixels (of the turn:
    at half the diagonal). slope: (n, 2, 3) of what the photo shows; x, y: (n,) in half diagonals.
    """

    photos: tuple[int, ...]
    photo: NDArray[np.intp]
    slope: Array
    x: Array
    y: Array
    cause = "camera_pose"
    of_photo = True
    proof = "the same photos aligned again, with more landmarks"

    @classmethod
    def of(cls, setting: Setting) -> CameraPose:
        pixels = setting.pixels
        photos, place = np.unique(pixels.photo, return_inverse=True)
        return cls(tuple(photos.tolist()), place.ravel(), pixels.slope, pixels.x, pixels.y)

    def elsewhere(self, setting: Setting, near: Near) -> CameraPose:
        pixels = setting.pixels
        return replace(
            self, photo=self.photo[near.photo], slope=pixels.slope, x=pixels.x, y=pixels.y
        )

    @property
    def numbers(self) -> Numbers:
        names = [f"photo {p + 1}, {way}" for p in self.photos for way in ("right", "down", "turn")]
        return Numbers.alike(names, "px", USUAL, -8.0, 8.0, step=0.01)

    @property
    def feels(self) -> NDArray[np.intp]:
        return felt_by(self.photo, 3)

    def after(self, radiance: Array, now: Situation, x: np.ndarray) -> Array:
        right, down, turn = (x[k::3][self.photo] for k in range(3))
        along = (right - turn * self.y)[:, None] * self.slope[:, 0]
        return radiance + along + (down + turn * self.x)[:, None] * self.slope[:, 1]

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        far = np.hypot(x[0::3], x[1::3])
        worst = int(np.argmax(far))
        return (
            f"photos do not lie where the scan says: photo {self.photos[worst] + 1} by "
            f"{far[worst]:.1f} pixels, {np.sqrt(np.mean(far**2)):.1f} on average"
        )
