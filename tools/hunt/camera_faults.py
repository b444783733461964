"""Faults of cameras as operations on images. Shares no code with Patina.

photos: list of (h, w, 3) linear radiance; every function returns new images of the same shapes.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

Array = np.ndarray


def tone(photos: list[Array], gamma: float) -> list[Array]:
    """Apply a power curve that does not change 18 % grey (of the white level)."""
    grey = 0.18 * max(float(np.percentile(p, 99)) for p in photos)
    return [grey * np.power(np.maximum(p, 0) / grey, gamma) for p in photos]


def clipped(photos: list[Array], level: float) -> list[Array]:
    """Clip at ``level``, a fraction of the brightest value of all photos."""
    top = max(float(p.max()) for p in photos)
    return [np.minimum(p, level * top) for p in photos]


def vignetted(photos: list[Array], corner: float) -> list[Array]:
    """Apply cos⁴ vignetting; corner: fraction by which the corners are darker."""
    height, width = photos[0].shape[:2]
    y, x = np.mgrid[:height, :width] + 0.5
    r2 = ((x - width / 2) ** 2 + (y - height / 2) ** 2) / (0.25 * (width**2 + height**2))
    tangent2 = max(1 - corner, 1e-3) ** -0.5 - 1  # the search for a strength may go beyond black
    return [p * (1 / (1 + tangent2 * r2) ** 2)[..., None] for p in photos]


def veiled(photos: list[Array], part: float) -> list[Array]:
    """Scatter a fraction ``part`` of the light: half uniformly, half nearby (veiling glare)."""
    out = []
    for p in photos:
        wide = 0.2 * np.hypot(*p.shape[:2])
        blur = np.stack([gaussian_filter(p[..., c], wide, mode="constant") for c in range(3)], -1)
        out.append((1 - part) * p + part * (0.5 * blur + 0.5 * p.mean(axis=(0, 1))))
    return out


def smudged(photos: list[Array], where: Array, wide: float, depth: float) -> list[Array]:
    """Darken a soft spot at the same position of every photo.

    where: (2,) and wide: position and standard deviation, fractions of the width. depth: darkening.
    """
    height, width = photos[0].shape[:2]
    y, x = np.mgrid[:height, :width] / width
    r2 = (x - where[0]) ** 2 + (y - where[1] * height / width) ** 2
    gain = 1 - min(depth, 0.95) * np.exp(-0.5 * r2 / wide**2)
    return [p * gain[..., None] for p in photos]


def striped(photos: list[Array], turn: float, period: float, depth: float) -> list[Array]:
    """Multiply by cosine stripes. turn: direction, radians; period: pixels; depth: amplitude."""
    height, width = photos[0].shape[:2]
    y, x = np.mgrid[:height, :width]
    wave = np.cos(2 * np.pi * (x * np.cos(turn) + y * np.sin(turn)) / period)
    return [p * (1 + min(depth, 0.95) * wave)[..., None] for p in photos]


def balanced(photos: list[Array], which: int, gains: Array) -> list[Array]:
    """Multiply the channels of photo ``which`` by exp(gains), (3,)."""
    return [p * np.exp(gains) if k == which else p for k, p in enumerate(photos)]


def with_noise(photos: list[Array], rng: np.random.Generator, well: float = 20_000) -> list[Array]:
    """Add shot and read noise. The 99th percentile is exposed to ``well`` electrons."""
    white = max(float(np.percentile(p, 99)) for p in photos)
    out = []
    for p in photos:
        electrons = p / white * well
        spread = np.sqrt(np.maximum(electrons, 0) + 4.0**2)
        out.append((electrons + spread * rng.standard_normal(p.shape)) / well * white)
    return out
