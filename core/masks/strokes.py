"""Detection of brush strokes: the palette colour that each changed pixel was painted with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MIN_OPACITY = 0.5  # of the brush colour: less is the soft rim of a stroke
MIN_CHANGE = 2  # of 255, in at least one channel


def strokes(
    before: NDArray[np.uint8], after: NDArray[np.uint8], palette: NDArray[np.uint8]
) -> NDArray[np.int32]:
    """(h, w) index of the palette colour (k, 3) that each pixel was painted with, −1 for none.

    before, after: (h, w, 3) uint8. The model of a brush is after = (1 − a)·before + a·colour. The
    colour with the smallest residual is taken, if its opacity a is at least MIN_OPACITY.
    """
    out = np.full(before.shape[:2], -1, np.int32)
    changed = (np.abs(after.astype(np.int16) - before) >= MIN_CHANGE).any(axis=2)
    if not changed.any():
        return out
    old, new = before[changed].astype(np.float32), after[changed].astype(np.float32)
    least = np.full(len(old), np.inf, np.float32)
    found, part = np.full(len(old), -1, np.int32), np.zeros(len(old), np.float32)
    for number, colour in enumerate(palette.astype(np.float32)):
        full, change = colour - old, new - old
        far = np.einsum("nc,nc->n", full, full)
        share = np.einsum("nc,nc->n", full, change) / np.maximum(far, 1e-6)
        share = np.clip(share, 0, 1)
        residual = np.square(change - share[:, None] * full).sum(axis=1)
        better = (residual < least) & (far > 0)
        least[better], found[better], part[better] = residual[better], number, share[better]
    out[changed] = np.where(part >= MIN_OPACITY, found, -1)
    return out


def overlaid(
    picture: NDArray[np.uint8],
    labels: NDArray[np.integer],
    palette: NDArray[np.uint8],
    opacity: float,
) -> NDArray[np.uint8]:
    """(h, w, 3) a picture overlaid with palette colours (k, 3); labels: (h, w) their indices,
    −1 for none."""
    there = labels >= 0
    out = picture.copy()
    mixed = (1 - opacity) * picture[there] + opacity * palette[labels[there]].astype(np.float32)
    out[there] = np.round(mixed).astype(np.uint8)
    return out
