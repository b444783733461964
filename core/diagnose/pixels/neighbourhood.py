"""What a photo shows around a pixel: its slope, and the wide blur that glare in the lens adds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

Array = NDArray[np.float32]

VEIL = 0.2  # standard deviation of the wide blur, fraction of the diagonal
MAX_SIDE = 128  # pixels, longer side of the photo that is blurred
STENCIL = np.array([-2, -1, 0, 1, 2])  # pixels, for the derivative of a Gaussian
WIDTH = 1.0  # pixels, standard deviation of that Gaussian


@dataclass(frozen=True)
class Veil:
    """blurred: (h / step, w / step, 3) a photo under a wide blur; mean: (3,) of the photo."""

    blurred: Array
    mean: Array
    step: int

    @classmethod
    def of(cls, radiance: Array) -> Veil:
        """radiance: (h, w, 3)."""
        height, width = radiance.shape[:2]
        step = max(1, max(height, width) // MAX_SIDE)
        small = np.stack([_shrunk(radiance[..., c], step) for c in range(3)], axis=-1)
        blur = VEIL * float(np.hypot(small.shape[0], small.shape[1]))
        small = np.stack(
            [gaussian_filter(small[..., c], blur, mode="constant") for c in range(3)], axis=-1
        )
        return cls(small, radiance.mean(axis=(0, 1)), step)

    def at(self, row: NDArray[np.integer], column: NDArray[np.integer]) -> Array:
        """(n, 2, 3) the blurred photo at pixels (n,), and the mean of the photo."""
        height, width = self.blurred.shape[:2]
        place = np.minimum(row // self.step, height - 1), np.minimum(column // self.step, width - 1)
        even = np.broadcast_to(self.mean, (len(row), 3))
        return np.stack([self.blurred[place], even], axis=1).astype(np.float32)


def photo_slopes(radiance: Array, pixel: NDArray[np.int32]) -> Array:
    """(n, 2, 3) derivatives to the right and down of a photo (h, w, 3) under a narrow Gaussian, per
    pixel. pixel: (n,) flat indices."""
    height, width = radiance.shape[:2]
    flat = radiance.reshape(-1, 3)
    row, column = np.divmod(pixel, width)
    bell = np.exp(-0.5 * (STENCIL / WIDTH) ** 2)
    bell /= bell.sum()
    rise = STENCIL * bell
    rise /= np.sum(rise * STENCIL)
    out = np.zeros((len(pixel), 2, 3), np.float32)
    for i, down in enumerate(STENCIL):
        for j, right in enumerate(STENCIL):
            at = np.clip(row + down, 0, height - 1) * width + np.clip(column + right, 0, width - 1)
            value = flat.take(at, axis=0)
            out[:, 0] += np.float32(bell[i] * rise[j]) * value
            out[:, 1] += np.float32(rise[i] * bell[j]) * value
    return out


def _shrunk(channel: Array, step: int) -> Array:
    """Means of a channel (h, w) over squares of ``step`` × ``step`` pixels."""
    height, width = (side // step * step for side in channel.shape)
    if step == 1:
        return channel
    cut = channel[:height, :width]
    return np.asarray(cut.reshape(height // step, step, width // step, step).mean(axis=(1, 3)))
