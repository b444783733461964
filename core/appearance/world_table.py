"""The bright spots of a picture of the world: a table from which directions are drawn.

The path that a measured material continues through a portal is not sampled towards lights.
Directions of bright spots are drawn from this table and in no other way, so that a small sun in an
HDR picture does not appear as isolated bright pixels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.floating]

MAX_SIZE = (256, 512)  # rows, columns of the table
BRIGHT = 3.0  # times the mean radiance of the world, for the brightest pixel of a cell


def world_texels(radiance: Array) -> NDArray[np.float32] | None:
    """(rows, columns, 3) from an equirectangular picture (h, w, 3), both with the zenith in row 0:
    R density per sr, 0 outside of bright spots; G cumulative probability at the end of the cell in
    its row; B at the end of the row. None where there is no bright spot. Raises InputError for an
    array that is not a picture."""
    if radiance.ndim != 3 or radiance.shape[2] < 3 or min(radiance.shape[:2]) < 2:
        raise InputError(f"a world picture of shape {radiance.shape}; expected (height, width, 3)")
    level = np.nan_to_num(radiance[..., :3].mean(axis=2, dtype=np.float64), posinf=0.0)
    peak = np.maximum(level, 0.0)
    level = _fewer(_fewer(peak, MAX_SIZE[0], 0, np.add), MAX_SIZE[1], 1, np.add)
    peak = _fewer(_fewer(peak, MAX_SIZE[0], 0, np.maximum), MAX_SIZE[1], 1, np.maximum)
    rows, columns = level.shape
    edges = np.cos(np.linspace(0.0, np.pi, rows + 1))
    solid = (edges[:-1] - edges[1:])[:, None] * 2 * np.pi / columns
    mean = float(np.sum(level * solid)) / (4 * np.pi)
    mass = np.where(peak > BRIGHT * mean, level, 0.0) * solid
    if not mass.sum() > 0:
        return None
    mass /= mass.sum()
    row = mass.sum(axis=1)
    out = np.empty((rows, columns, 3), np.float32)
    out[..., 0] = mass / solid
    out[..., 1] = np.cumsum(mass, axis=1) / np.maximum(row, 1e-30)[:, None]
    out[..., 2] = np.cumsum(row)[:, None]
    out[:, -1, 1], out[-1, :, 2] = 1.0, 1.0
    return out


def _fewer(values: Array, largest: int, axis: int, of: np.ufunc) -> Array:
    """Means (``of`` np.add) or maxima of neighbours along an axis, so that at most ``largest``
    remain."""
    count = values.shape[axis]
    if count <= largest:
        return values
    starts = np.arange(largest) * count // largest
    found = of.reduceat(values, starts, axis=axis)
    if of is not np.add:
        return found
    sizes = np.diff(np.append(starts, count))
    return found / (sizes[:, None] if axis == 0 else sizes)
