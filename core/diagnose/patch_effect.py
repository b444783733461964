"""Effects with a few numbers for each of many patches, of the surface or of a photo."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .effect import Array, Effect, Near, Setting


@dataclass(frozen=True)
class PatchEffect(Effect):
    """parts: (n,) patch of each pixel, −1 none; usual: (e,) deviation of a patch's numbers."""

    parts: NDArray[np.intp]
    usual: tuple[float, ...]

    def elsewhere(self, setting: Setting, near: Near) -> Effect:
        return replace(self, parts=self.parts[near.surface])

    @property
    def patch(self) -> NDArray[np.intp]:
        return self.parts

    @property
    def count(self) -> int:
        """Of patches."""
        return int(self.parts.max()) + 1

    @property
    def deviation(self) -> NDArray[np.float64]:
        """(count · e,) of the numbers, patch by patch."""
        return np.tile(self.usual, self.count)

    def expecting(self, usual: NDArray[np.float64]) -> Effect:
        return replace(self, usual=tuple(usual.tolist()))

    def felt(self, x: NDArray[np.float64]) -> Array:
        """(n, e) the numbers of each pixel's patch, float32."""
        numbers = x.reshape(-1, len(self.usual))[self.parts]
        return np.where(self.parts[:, None] >= 0, numbers, 0.0).astype(np.float32)
