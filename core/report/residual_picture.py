"""What every photo shows more or less than the prediction, as a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..diagnose.forward.pixels import Pixels
from ..views import display

LONGEST = 260
WITHIN = 3.0  # typical distances between the pixels that were looked at
FULL = 3.0  # deviations, for full colour


def photo_most_changed(pixels: Pixels, changed: NDArray[np.floating]) -> int | None:
    """By a change (n, 3) in deviations, a pixel of it; None where nothing changes."""
    strength = np.bincount(pixels.photo, np.sum(changed**2, axis=1))
    if not strength.any():
        return None
    return int(np.argmax(strength / np.maximum(np.bincount(pixels.photo), 1)))


def residual_picture(
    pixels: Pixels, residual: NDArray[np.floating], photo: int
) -> NDArray[np.uint8]:
    """(h, w, 3) of the part of a photo that shows the object: prediction too dark blue, too bright
    red, full colour at FULL deviations. residual: (n, 3) photo − prediction in deviations."""
    rows = np.flatnonzero((pixels.photo == photo) & np.isfinite(residual).all(axis=1))
    at = np.stack([pixels.x[rows], pixels.y[rows]], axis=1).astype(np.float64)
    if not len(at):
        return np.full((1, 1, 3), display.UNKNOWN)
    low, high = at.min(axis=0), at.max(axis=0)
    size = float((high - low).max()) or 1.0
    width, height = np.maximum(1, np.ceil(LONGEST * (high - low) / size)).astype(int)
    columns = low[0] + (np.arange(width) + 0.5) * size / LONGEST
    lines = low[1] + (np.arange(height) + 0.5) * size / LONGEST
    grid = np.stack(np.meshgrid(columns, lines), axis=-1).reshape(-1, 2)
    typical = np.sqrt(np.prod(np.maximum(high - low, 1e-9)) / len(at))
    far, which = cKDTree(at).query(grid, distance_upper_bound=WITHIN * typical)
    known = np.isfinite(far)
    shown = np.full((len(grid), 1), np.nan)
    shown[known, 0] = residual[rows[which[known]]].mean(axis=1)
    image = shown.reshape(height, width, 1)
    return display.difference_picture(-image, np.zeros_like(image), FULL)
