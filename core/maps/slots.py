"""The most accurate samples of each texel, in memory independent of the number of photos."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

SLOTS = 8  # samples kept for each texel, those with the smallest errors; a ninth would add little


@dataclass(frozen=True)
class TexelSamples:
    """m samples of one photo. texel: (m,) rows of the band. scale: (m, 3) factor of the diffuse
    body that gives the observed radiance. error: (m,) its standard error. specular: (m,) specular
    share of the fitted BRDF. gloss: (m,) derivative of the scale by ln α. material: (m,) uint8."""

    texel: NDArray[np.intp]
    scale: NDArray[np.floating]
    error: NDArray[np.floating]
    specular: NDArray[np.floating]
    gloss: NDArray[np.floating]
    material: NDArray[np.uint8]

    def moved(self, by: int) -> TexelSamples:
        """The same samples with ``by`` added to the row numbers."""
        return replace(self, texel=self.texel + by)


@dataclass
class TexelSlots:
    """The best samples of n texels, with the fields of TexelSamples. scale: (SLOTS, n, 3); error,
    specular, gloss: (SLOTS, n), the error of an empty slot is infinite; material: (SLOTS, n);
    count: (n,) number of samples that were added."""

    scale: NDArray[np.float16]
    error: NDArray[np.float16]
    specular: NDArray[np.float16]
    gloss: NDArray[np.float16]
    material: NDArray[np.uint8]
    count: NDArray[np.uint16]

    @classmethod
    def empty(cls, n: int) -> TexelSlots:
        """Empty slots for n texels."""
        return cls(
            np.zeros((SLOTS, n, 3), np.float16),
            np.full((SLOTS, n), np.inf, np.float16),
            np.zeros((SLOTS, n), np.float16),
            np.zeros((SLOTS, n), np.float16),
            np.zeros((SLOTS, n), np.uint8),
            np.zeros(n, np.uint16),
        )

    def add(self, samples: TexelSamples) -> None:
        """Add the samples of a photo, at most one for each texel; each replaces the sample with the
        largest error if its own error is smaller."""
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
