"""Where in the photo is a sphere? A circle by votes of the edges, then its outline."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..errors import InputError
from ..scan.camera import Camera
from .sphere_edge import RefinedOutline, refine_outline
from .sphere_outline import Circle, circle_pixels, fit_sphere, pixel_radius

Array = NDArray[np.float64]

LONGEST = 240  # pixels of the reduced photo
SMALLEST = 0.04  # radius, of the photo's longer side
LARGEST = 0.6
EDGES = 0.12  # of the pixels vote: those with the strongest gradient
TRIED = 8  # circles refined
LEAST_SUPPORT = 0.5  # of the outline found, when nobody pointed at it


def search_sphere(pixels: NDArray, camera: Camera) -> RefinedOutline | None:
    """The sphere of (h, w, 3) linear pixels whose outline is seen best; None where none is.

    Each edge of the reduced photo votes for the centres that lie along its gradient (Hough
    transform for circles); the circles with most votes are refined, the one with most of its
    outline found wins.
    """
    grey = np.asarray(pixels, float).mean(axis=2)
    step = max(1, -(-max(grey.shape) // LONGEST))
    rows, columns = (grey.shape[0] // step) * step, (grey.shape[1] // step) * step
    small = grey[:rows, :columns].reshape(rows // step, step, columns // step, step)
    small = small.mean(axis=(1, 3))
    if min(small.shape) < 16:
        return None
    small = small / (np.abs(small) + max(float(np.median(small)), 1e-3 * float(small.max()), 1e-30))
    best: RefinedOutline | None = None
    for x, y, radius in _circles(small):
        circle = Circle((x * step, y * step), radius * step)
        try:
            start = fit_sphere(camera, circle_pixels(circle))
        except InputError:
            continue
        found = refine_outline(pixels, camera, start, search=0.12)
        if found is None or found.support < LEAST_SUPPORT:
            continue
        if best is None or _worth(found, camera) > _worth(best, camera):
            best = found
    return best


def _worth(found: RefinedOutline, camera: Camera) -> float:
    """The outline's share that is seen; of two alike the larger (the other is inside it)."""
    return found.worth * pixel_radius(found.sphere, camera) ** 0.25


def _circles(small: Array) -> list[tuple[float, float, float]]:
    """(x, y, radius) of the circles with most votes, pixels of the reduced photo."""
    height, width = small.shape
    down = ndimage.gaussian_filter(small, 1.0, order=(1, 0))
    across = ndimage.gaussian_filter(small, 1.0, order=(0, 1))
    slope = np.hypot(down, across)
    strong = slope > max(float(np.quantile(slope, 1 - EDGES)), 1e-6)
    y, x = np.nonzero(strong)
    if len(y) == 0:
        return []
    unit_y, unit_x = down[strong] / slope[strong], across[strong] / slope[strong]
    radii = np.arange(max(5.0, SMALLEST * max(small.shape)), LARGEST * max(small.shape), 1.5)
    scores = np.zeros((len(radii), height, width), np.float32)
    for layer, radius in enumerate(radii):
        for sign in (-1, 1):
            at_x = np.floor(x + 0.5 + sign * radius * unit_x).astype(int)
            at_y = np.floor(y + 0.5 + sign * radius * unit_y).astype(int)
            ok = (at_x >= 0) & (at_x < width) & (at_y >= 0) & (at_y < height)
            votes = np.bincount(at_y[ok] * width + at_x[ok], minlength=height * width)
            scores[layer] += votes.reshape(height, width)
        # votes spread over more pixels the farther they are cast: 2° of gradient
        wide = 0.7 + 0.02 * radius
        scores[layer] = ndimage.gaussian_filter(scores[layer], wide) * wide / np.sqrt(radius)
    found = []
    for _ in range(TRIED):
        place = np.unravel_index(int(np.argmax(scores)), scores.shape)
        index, row, column = (int(axis) for axis in place)
        if scores[index, row, column] <= 0:
            break
        radius = float(radii[index])
        found.append((column + 0.5, row + 0.5, radius))
        near = max(3, int(0.15 * radius))
        lower, upper = np.searchsorted(radii, (0.85 * radius, 1.15 * radius))
        scores[
            lower:upper,
            max(0, row - near) : row + near + 1,
            max(0, column - near) : column + near + 1,
        ] = 0
    return found
