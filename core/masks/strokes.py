"""What was painted over a picture: which colour each changed pixel was given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

HALF = 0.5  # of a brush's colour: less is the soft rim of a stroke
TOUCHED = 2  # of 255, that a channel changes by at least


def strokes(
    before: NDArray[np.uint8], after: NDArray[np.uint8], palette: NDArray[np.uint8]
) -> NDArray[np.int32]:
    """(h, w) which colour of the palette (k, 3) each pixel was painted with, −1 where it was not.

    before, after: (h, w, 3). A brush mixes: after = (1 − a) before + a colour; taken is the colour
    that explains a pixel best, where a is at least one half.
    """
    out = np.full(before.shape[:2], -1, np.int32)
    changed = (np.abs(after.astype(np.int16) - before) >= TOUCHED).any(axis=2)
    if not changed.any():
        return out
    old, new = before[changed].astype(np.float32), after[changed].astype(np.float32)
    least = np.full(len(old), np.inf, np.float32)
    found, part = np.full(len(old), -1, np.int32), np.zeros(len(old), np.float32)
    for number, colour in enumerate(palette.astype(np.float32)):
        way, gone = colour - old, new - old
        far = np.einsum("nc,nc->n", way, way)
        share = np.einsum("nc,nc->n", way, gone) / np.maximum(far, 1e-6)
        share = np.clip(share, 0, 1)
        miss = np.square(gone - share[:, None] * way).sum(axis=1)
        better = (miss < least) & (far > 0)
        least[better], found[better], part[better] = miss[better], number, share[better]
    out[changed] = np.where(part >= HALF, found, -1)
    return out


def overlaid(
    picture: NDArray[np.uint8],
    worn: NDArray[np.integer],
    palette: NDArray[np.uint8],
    opacity: float,
) -> NDArray[np.uint8]:
    """(h, w, 3) a picture under colours of the palette (k, 3), worn (h, w), −1 none."""
    there = worn >= 0
    out = picture.copy()
    mixed = (1 - opacity) * picture[there] + opacity * palette[worn[there]].astype(np.float32)
    out[there] = np.round(mixed).astype(np.uint8)
    return out
