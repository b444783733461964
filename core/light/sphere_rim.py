"""The brightness across a sphere's rim, and where in it the outline is.

A smooth sphere has no step at its outline: towards grazing incidence its reflectance rises to one,
and what it mirrors there is what stands behind it, so that its brightness runs into the
background's. The point of steepest change is inside the outline (by 0.35 pixels for a glossy ball
of 50 pixels, 1° of light direction at 60° incidence). The run has a known shape, Schlick's (1994)
approximation of Fresnel's reflectance over the sphere's known normals, whatever the sphere is made
of; the blur is fitted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLURS = (0.35, 0.6, 1.0, 1.6, 2.6, 4.0)  # pixels; a pixel's own width is 0.29
SHIFTS = np.arange(-2.0, 2.01, 0.1)
FINE = 0.1  # pixels of the shape's own grid


def rim_shape(offsets: Array, radius: float, blur: float) -> Array:
    """Brightness at ``offsets`` (pixels outward from the outline of a sphere of ``radius``
    pixels), any shape: 1 outside; Schlick's (1 − cos θ)⁵ inside, sin θ = r/R; with a Gaussian blur
    (pixels)."""
    reach = float(np.abs(offsets).max()) + 4 * blur + FINE
    grid = np.arange(-reach, reach + FINE, FINE)
    relative = np.minimum(np.maximum(1 + grid / radius, 0.0), 1.0)
    grazing = (1 - np.sqrt(1 - relative**2)) ** 5
    sharp = np.where(grid > 0, 1.0, grazing)
    kernel = np.exp(-0.5 * (np.arange(-4 * blur, 4 * blur + FINE, FINE) / blur) ** 2)
    padded = np.pad(sharp, len(kernel), mode="edge")
    soft = np.convolve(padded, kernel / kernel.sum(), mode="same")[len(kernel) : -len(kernel)]
    return np.interp(offsets, grid, soft)


def best_blur(offsets: Array, values: Array, radius: float) -> float:
    """Pixels of blur that explain most of the typical profile. offsets: (k,). values: (n, k)."""
    typical = [
        np.sort(unexplained(offsets, values, radius, blur).min(axis=1))[: max(1, len(values) // 2)]
        for blur in BLURS
    ]
    return BLURS[int(np.argmin([np.mean(left) for left in typical]))]


def unexplained(offsets: Array, values: Array, radius: float, blur: float) -> Array:
    """(n, shifts) share of each profile's variance that a + b · rim_shape, shifted, leaves."""
    shapes = rim_shape(offsets[None] - SHIFTS[:, None], radius, blur)
    shapes = shapes - shapes.mean(axis=1, keepdims=True)
    shapes /= np.linalg.norm(shapes, axis=1, keepdims=True)
    centred = values - values.mean(axis=1, keepdims=True)
    total = np.maximum((centred**2).sum(axis=1, keepdims=True), 1e-300)
    return 1 - (centred @ shapes.T) ** 2 / total
