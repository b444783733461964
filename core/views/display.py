"""Linear radiance → 8-bit sRGB pixels for display."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..photo.transfer import srgb_encoded

UNKNOWN = np.array([58, 60, 64], np.uint8)  # dark grey: no value
# signed differences: blue too dark, light grey no difference, red too bright (the diverging colour
# map of Moreland)
TOO_DARK = np.array([59, 76, 192], np.float32)
RIGHT = np.array([236, 236, 236], np.float32)
TOO_BRIGHT = np.array([180, 4, 38], np.float32)


def srgb(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Linear values, clipped to 0..1, by the transfer curve of IEC 61966-2-1; NaN gives 0."""
    x = np.clip(np.nan_to_num(linear), 0.0, 1.0)
    return (srgb_encoded(x) * 255.0 + 0.5).astype(np.uint8)


def white_level(radiance: NDArray[np.floating], percentile: float = 99.0) -> float:
    """The radiance shown as white, a percentile of the finite values: brighter highlights clip,
    and the rest of the surface stays readable."""
    values = radiance[np.isfinite(radiance)]
    return float(max(np.percentile(values, percentile), 1e-9)) if values.size else 1.0


def photo_picture(radiance: NDArray[np.floating], white: float) -> NDArray[np.uint8]:
    """(h, w, 3) display pixels; pixels with NaN are shown in the grey UNKNOWN."""
    picture = srgb(radiance / white)
    picture[~np.isfinite(radiance).all(axis=-1)] = UNKNOWN
    return picture


def difference_picture(
    predicted: NDArray[np.floating], measured: NDArray[np.floating], scale: float
) -> NDArray[np.uint8]:
    """(h, w, 3) signed difference predicted − measured of the channel means, full colour at
    ± scale; UNKNOWN where either is NaN."""
    difference = (predicted - measured).mean(axis=-1) / scale
    known = np.isfinite(difference)
    t = np.clip(np.nan_to_num(difference), -1.0, 1.0)[..., None].astype(np.float32)
    end = np.where(t < 0, TOO_DARK, TOO_BRIGHT)
    picture = (RIGHT + (end - RIGHT) * np.abs(t) + 0.5).astype(np.uint8)
    picture[~known] = UNKNOWN
    return picture


def crop_box(known: NDArray[np.bool_], margin: int) -> tuple[slice, slice]:
    """(rows, columns) around the True pixels, with a margin in pixels; everything without any."""
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if rows.size == 0:
        return slice(None), slice(None)
    return (
        slice(max(0, rows[0] - margin), rows[-1] + 1 + margin),
        slice(max(0, columns[0] - margin), columns[-1] + 1 + margin),
    )


def shrink_factor(shape: tuple[int, ...], longest: int) -> int:
    """The integer factor by which (h, w, …) shrinks so that no side exceeds ``longest``."""
    return max(1, -(-max(shape[:2]) // longest))


def shrink(pixels: NDArray[np.number], longest: int) -> NDArray:
    """Means over square blocks of pixels, so that no side exceeds ``longest``. A block is NaN only
    where at least half of its pixels are."""
    factor = shrink_factor(pixels.shape, longest)
    if factor == 1:
        return pixels
    rows, columns = (n // factor for n in pixels.shape[:2])
    out = np.empty((rows, columns, *pixels.shape[2:]), np.float64)
    for row in range(rows):  # row by row: less memory than the whole photo
        line = pixels[row * factor : (row + 1) * factor, : columns * factor]
        blocks = line.reshape(factor, columns, factor, -1)
        known = np.isfinite(blocks)
        total = np.where(known, blocks, 0).sum(axis=(0, 2), dtype=np.float64)
        count = known.sum(axis=(0, 2))
        mean = np.where(count > factor**2 / 2, total / np.maximum(count, 1), np.nan)
        out[row] = mean.reshape(out[row].shape)
    return out
