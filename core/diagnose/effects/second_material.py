"""Some parts of the surface are of another material: brighter, darker or of another colour."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effect import Array, Effect, Numbers, Setting
from ..patches import median_of, surface_patches
from ..situation import Situation

USUAL = 0.15
LEAST, MOST = -0.95, 9.0
OTHER = 0.03  # more or less than the rest, from which a patch counts as another material


@dataclass(frozen=True)
class SecondMaterial(Effect):
    """numbers: for each patch of the surface how much more it reflects, red, green, blue, as a part
    of what the material would (so that a patch that is left out, and falls back to 0, is predicted
    by a Newton step as well as by the model itself). parts: (n,) patch of each pixel, −1 none."""

    parts: NDArray[np.intp]
    usual: tuple[float, ...] = (USUAL,) * 3
    cause = "second_material"
    proof = "a mask of the part that looks different, painted in one photo"

    @classmethod
    def of(cls, setting: Setting) -> SecondMaterial | None:
        patch = surface_patches(setting)
        return cls(patch) if (patch >= 0).any() else None

    @property
    def patch(self) -> NDArray[np.intp]:
        return self.parts

    @property
    def numbers(self) -> Numbers:
        count = int(self.parts.max()) + 1
        names = [f"patch {k + 1}, {c}" for k in range(count) for c in ("red", "green", "blue")]
        alike = Numbers.alike(names, "", 1.0, LEAST, MOST)
        deviation = np.tile(self.usual, len(names) // len(self.usual))
        return replace(alike, deviation=deviation)

    def expecting(self, usual: np.ndarray) -> Effect:
        return replace(self, usual=tuple(usual.tolist()))

    def guess(self, ratio: Array) -> np.ndarray:
        more = np.clip(ratio, 1 + LEAST, 1 + MOST) - 1
        return np.stack([median_of(self.parts, more[:, c]) for c in range(3)], axis=1).ravel()

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        more = np.where(self.parts[:, None] >= 0, x.reshape(-1, 3)[self.parts], 0.0)
        return replace(now, irradiance=now.irradiance * (1 + more).astype(np.float32))

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        more = x.reshape(-1, 3).mean(axis=1)
        more = more - np.median(more)
        other = np.abs(more) > OTHER
        share = 100 * float(other.mean())
        size = 100 * float(np.mean(np.abs(more[other]))) if other.any() else 0.0
        return (
            f"there is more than one material: {share:.0f} % of the surface reflects about "
            f"{size:.0f} % more or less than the rest (paint a mask of it)"
        )
