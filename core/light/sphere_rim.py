"""Model of the brightness across a sphere's rim, to locate the outline in it.

A smooth sphere has no brightness step at its outline. Towards grazing incidence its reflectance
rises to one, and there it mirrors the scene behind it, so that its brightness blends into the
background's. The steepest change is inside the outline (by 0.35 pixels for a glossy ball of 50
pixels, which is 1° of light direction at 60° incidence). The profile has a known shape for every
sphere material: Schlick's (1994) approximation of Fresnel reflectance over the sphere's known
normals. The blur is fitted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLURS = (0.35, 0.6, 1.0, 1.6, 2.6, 4.0)  # pixels; a pixel's own width is 0.29
SHIFTS = np.arange(-2.0, 2.01, 0.1)  # pixels
GRID_STEP = 0.1  # pixels, of the grid on which the shape is computed


def rim_shape(offsets: Array, radius: float, blur: float) -> Array:
    """Normalised brightness across the rim: 1 outside, Schlick's (1 − cos θ)⁵ with sin θ = r/R
    inside, convolved with a Gaussian.

    offsets: pixels outward from the outline, any array shape, which the result has too; radius: of
    the sphere, pixels; blur: standard deviation, pixels.
    """
    reach = float(np.abs(offsets).max()) + 4 * blur + GRID_STEP
    grid = np.arange(-reach, reach + GRID_STEP, GRID_STEP)
    relative = np.minimum(np.maximum(1 + grid / radius, 0.0), 1.0)
    grazing = (1 - np.sqrt(1 - relative**2)) ** 5
    sharp = np.where(grid > 0, 1.0, grazing)
    kernel = np.exp(-0.5 * (np.arange(-4 * blur, 4 * blur + GRID_STEP, GRID_STEP) / blur) ** 2)
    padded = np.pad(sharp, len(kernel), mode="edge")
    soft = np.convolve(padded, kernel / kernel.sum(), mode="same")[len(kernel) : -len(kernel)]
    return np.interp(offsets, grid, soft)


def best_blur(offsets: Array, values: Array, radius: float) -> float:
    """The blur, in pixels, that explains the better half of the profiles best. offsets: (k,)
    pixels; values: (n, k)."""
    typical = [
        np.sort(unexplained(offsets, values, radius, blur).min(axis=1))[: max(1, len(values) // 2)]
        for blur in BLURS
    ]
    return BLURS[int(np.argmin([np.mean(left) for left in typical]))]


def unexplained(offsets: Array, values: Array, radius: float, blur: float) -> Array:
    """(n, shifts) share of each profile's variance that a + b · rim_shape, shifted by SHIFTS, does
    not explain."""
    shapes = rim_shape(offsets[None] - SHIFTS[:, None], radius, blur)
    shapes = shapes - shapes.mean(axis=1, keepdims=True)
    shapes /= np.linalg.norm(shapes, axis=1, keepdims=True)
    centred = values - values.mean(axis=1, keepdims=True)
    total = np.maximum((centred**2).sum(axis=1, keepdims=True), 1e-300)
    return 1 - (centred @ shapes.T) ** 2 / total
