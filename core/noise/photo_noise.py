"""The noise of a photo's pixels: a model of a single exposure, an image of merged ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class PixelNoise(Protocol):
    """The noise of the pixels of one photo."""

    def at(self, pixel: NDArray[np.integer], radiance: NDArray) -> NDArray[np.float32]:
        """(n, 3) variance of the radiance of n pixels. pixel: (n,) flat index in the photo;
        radiance: (n, 3) recorded there."""


@dataclass(frozen=True)
class PhotoNoise:
    """Noise of one exposure, var(L) = read² + shot · L per channel (EMVA 1288), in the photo's
    linear units; a PixelNoise. shot: (3,); read: (3,); step: distance in pixels from which noise is
    independent; blocks: number of blocks that the estimate used (0: no estimate was possible, the
    values are those of quantisation alone)."""

    shot: NDArray[np.float64]
    read: NDArray[np.float64]
    step: int = 1
    blocks: int = 0

    def variance(self, radiance: NDArray) -> NDArray[np.float32]:
        """(…, 3) variance of pixels whose true value is ``radiance`` (…, 3)."""
        shot, read = self.shot.astype(np.float32), self.read.astype(np.float32)
        return np.asarray(np.maximum(radiance, 0) * shot + read**2, np.float32)

    def at(self, pixel: NDArray[np.integer], radiance: NDArray) -> NDArray[np.float32]:
        """See PixelNoise."""
        return self.variance(radiance)

    def per_exposure(self, exposure: float) -> PhotoNoise:
        """The noise of the photo divided by its ``exposure``."""
        return PhotoNoise(self.shot / exposure, self.read / exposure, self.step, self.blocks)


@dataclass(frozen=True)
class MergedNoise:
    """Noise of merged exposures; a PixelNoise. variance: (h, w, 3) of the radiance."""

    variance: NDArray[np.float32]

    def at(self, pixel: NDArray[np.integer], radiance: NDArray) -> NDArray[np.float32]:
        """See PixelNoise."""
        return self.variance.reshape(-1, 3).take(pixel, axis=0)
