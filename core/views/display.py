"""Linear radiance → 8-bit pixels a person can look at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

UNKNOWN = np.array([58, 60, 64], np.uint8)
# signed differences: too dark blue, right light grey, too bright red (Moreland's diverging pair)
TOO_DARK = np.array([59, 76, 192], np.float32)
RIGHT = np.array([236, 236, 236], np.float32)
TOO_BRIGHT = np.array([180, 4, 38], np.float32)


def srgb(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """IEC 61966-2-1 transfer curve of values in 0..1 (clipped)."""
    x = np.clip(np.nan_to_num(linear), 0.0, 1.0)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)
    return (encoded * 255.0 + 0.5).astype(np.uint8)


def white_level(radiance: NDArray[np.floating], percentile: float = 99.0) -> float:
    """The radiance shown as white: highlights above it clip, the body stays readable."""
    values = radiance[np.isfinite(radiance)]
    return float(max(np.percentile(values, percentile), 1e-9)) if values.size else 1.0


def photo_picture(radiance: NDArray[np.floating], white: float) -> NDArray[np.uint8]:
    """(h, w, 3) display pixels; NaN is shown as the grey of the unknown."""
    picture = srgb(radiance / white)
    picture[~np.isfinite(radiance).all(axis=-1)] = UNKNOWN
    return picture


def difference_picture(
    predicted: NDArray[np.floating], measured: NDArray[np.floating], scale: float
) -> NDArray[np.uint8]:
    """Signed difference of the channel means, full colour at ± scale."""
    difference = (predicted - measured).mean(axis=-1) / scale
    known = np.isfinite(difference)
    t = np.clip(np.nan_to_num(difference), -1.0, 1.0)[..., None].astype(np.float32)
    end = np.where(t < 0, TOO_DARK, TOO_BRIGHT)
    picture = (RIGHT + (end - RIGHT) * np.abs(t) + 0.5).astype(np.uint8)
    picture[~known] = UNKNOWN
    return picture


def crop_box(known: NDArray[np.bool_], margin: int) -> tuple[slice, slice]:
    """The rows and columns that hold something, with a margin."""
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if rows.size == 0:
        return slice(None), slice(None)
    return (
        slice(max(0, rows[0] - margin), rows[-1] + 1 + margin),
        slice(max(0, columns[0] - margin), columns[-1] + 1 + margin),
    )


def shrink_factor(shape: tuple[int, ...], longest: int) -> int:
    """Pixels of (h, w, …) to one, along each side, so that no side exceeds ``longest``."""
    return max(1, -(-max(shape[:2]) // longest))


def shrink(pixels: NDArray[np.number], longest: int) -> NDArray:
    """Mean over blocks of whole pixels so that no side exceeds ``longest``; NaN does not spread."""
    factor = shrink_factor(pixels.shape, longest)
    if factor == 1:
        return pixels
    rows, columns = (n // factor for n in pixels.shape[:2])
    out = np.empty((rows, columns, *pixels.shape[2:]), np.float64)
    for row in range(rows):  # a photo's worth of intermediate numbers is too much
        line = pixels[row * factor : (row + 1) * factor, : columns * factor]
        blocks = line.reshape(factor, columns, factor, -1)
        known = np.isfinite(blocks)
        total = np.where(known, blocks, 0).sum(axis=(0, 2), dtype=np.float64)
        count = known.sum(axis=(0, 2))
        mean = np.where(count > factor**2 / 2, total / np.maximum(count, 1), np.nan)
        out[row] = mean.reshape(out[row].shape)
    return out
