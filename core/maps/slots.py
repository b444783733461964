"""What photos say of each texel: the best few of their samples, in memory that the number of photos
does not change."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

SLOTS = 8  # samples kept of a texel: the best; a ninth would add little


@dataclass(frozen=True)
class TexelSamples:
    """m samples of one photo. texel: (m,) rows of the band. scale: (m, 3) what the body had to be
    multiplied by to show this radiance. error: (m,) its standard error. specular: (m,) share of the
    fitted BRDF that is specular there. gloss: (m,) what ln α would change the sample's scale by.
    material: (m,) uint8."""

    texel: NDArray[np.intp]
    scale: NDArray[np.floating]
    error: NDArray[np.floating]
    specular: NDArray[np.floating]
    gloss: NDArray[np.floating]
    material: NDArray[np.uint8]

    def moved(self, by: int) -> TexelSamples:
        """The same samples with other row numbers."""
        return replace(self, texel=self.texel + by)


@dataclass
class TexelSlots:
    """scale: (SLOTS, n, 3); error, specular, gloss: (SLOTS, n), error infinite where a slot is
    empty; material: (SLOTS, n); count: (n,) samples that came."""

    scale: NDArray[np.float16]
    error: NDArray[np.float16]
    specular: NDArray[np.float16]
    gloss: NDArray[np.float16]
    material: NDArray[np.uint8]
    count: NDArray[np.uint16]

    @classmethod
    def empty(cls, n: int) -> TexelSlots:
        """For n texels."""
        return cls(
            np.zeros((SLOTS, n, 3), np.float16),
            np.full((SLOTS, n), np.inf, np.float16),
            np.zeros((SLOTS, n), np.float16),
            np.zeros((SLOTS, n), np.float16),
            np.zeros((SLOTS, n), np.uint8),
            np.zeros(n, np.uint16),
        )

    def add(self, samples: TexelSamples) -> None:
        """Put a photo's samples (each texel at most once) in the place of worse ones."""
        texel = samples.texel
        self.count[texel] += 1
        worst = self.error[:, texel].argmax(axis=0)
        better = samples.error.astype(np.float16) < self.error[worst, texel]
        slot, texel = worst[better], texel[better]
        self.scale[slot, texel] = np.clip(samples.scale[better], -1e4, 1e4)
        self.error[slot, texel] = samples.error[better]
        self.specular[slot, texel] = samples.specular[better]
        self.gloss[slot, texel] = np.clip(samples.gloss[better], -1e3, 1e3)
        self.material[slot, texel] = samples.material[better]
