"""Search a photo for a sphere: circles by a Hough transform, then a refined outline."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..errors import InputError
from ..scan.camera import Camera
from .sphere_edge import RefinedOutline, refine_outline
from .sphere_outline import Circle, circle_pixels, fit_sphere, pixel_radius

Array = NDArray[np.float64]

REDUCED_SIDE = 240  # pixels, longer side of the reduced photo
MIN_RADIUS = 0.04  # of the photo's longer side
MAX_RADIUS = 0.6  # the same
EDGE_SHARE = 0.12  # of the pixels that vote: those with the strongest gradient
MAX_CIRCLES = 8  # that are refined
MIN_SUPPORT = 0.5  # share of the outline that must be found where the user gave no outline


def search_sphere(pixels: NDArray, camera: Camera) -> RefinedOutline | None:
    """The sphere with the clearest outline in (h, w, 3) linear pixels; None where there is none.

    Each edge of the reduced photo votes for the centres along its gradient (Hough transform for
    circles). The circles with most votes are refined, and the best refined outline wins.
    """
    grey = np.asarray(pixels, float).mean(axis=2)
    step = max(1, -(-max(grey.shape) // REDUCED_SIDE))
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
        if found is None or found.support < MIN_SUPPORT:
            continue
        if best is None or _size_score(found, camera) > _size_score(best, camera):
            best = found
    return best


def _size_score(found: RefinedOutline, camera: Camera) -> float:
    """The outline's score, weighted by size: of two similar outlines the smaller one is usually
    inside the sphere."""
    return found.score * pixel_radius(found.sphere, camera) ** 0.25


def _circles(small: Array) -> list[tuple[float, float, float]]:
    """(x, y, radius) of the circles with most votes, pixels of the reduced photo."""
    height, width = small.shape
    down = ndimage.gaussian_filter(small, 1.0, order=(1, 0))
    across = ndimage.gaussian_filter(small, 1.0, order=(0, 1))
    slope = np.hypot(down, across)
    strong = slope > max(float(np.quantile(slope, 1 - EDGE_SHARE)), 1e-6)
    y, x = np.nonzero(strong)
    if len(y) == 0:
        return []
    unit_y, unit_x = down[strong] / slope[strong], across[strong] / slope[strong]
    radii = np.arange(max(5.0, MIN_RADIUS * max(small.shape)), MAX_RADIUS * max(small.shape), 1.5)
    scores = np.zeros((len(radii), height, width), np.float32)
    for layer, radius in enumerate(radii):
        for sign in (-1, 1):
            at_x = np.floor(x + 0.5 + sign * radius * unit_x).astype(int)
            at_y = np.floor(y + 0.5 + sign * radius * unit_y).astype(int)
            ok = (at_x >= 0) & (at_x < width) & (at_y >= 0) & (at_y < height)
            votes = np.bincount(at_y[ok] * width + at_x[ok], minlength=height * width)
            scores[layer] += votes.reshape(height, width)
        # an error of 2° in the gradient's direction spreads votes in proportion to the radius
        wide = 0.7 + 0.02 * radius
        scores[layer] = ndimage.gaussian_filter(scores[layer], wide) * wide / np.sqrt(radius)
    found = []
    for _ in range(MAX_CIRCLES):
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
