"""Tone curve and white balance from a photo of a colour chart or a grey scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from ..errors import PatinaError
from ..photo.transfer import SRGB, Transfer

Array = NDArray[np.float64]

# The grey row of the ColorChecker Classic, white to black, by the densities printed on the chart
COLORCHECKER_GREYS = tuple(10.0**-d for d in (0.05, 0.23, 0.44, 0.70, 1.05, 1.50))
ROWS, COLUMNS = 4, 6
PATCH = 0.25  # of the distance between patches: half the side of what is measured of each
TOP = 0.995  # encoded values from here on may be clipped
NOT_EVEN = 0.08  # scatter within a patch, relative to it, that deserves a word
POINTS = 257


@dataclass(frozen=True)
class ChartTone:
    """transfer: encoded → linear, grey is grey, white is white's reflectance. encoded, reflectance:
    (n, 3), (n,) of the grey patches used, dark to light. gamma: (3,) mean slope of log reflectance
    over log sRGB-decoded value: 1 where the photo is what its sRGB curve says. notes: sentences."""

    transfer: Transfer
    encoded: Array
    reflectance: Array
    gamma: Array
    notes: tuple[str, ...]


def chart_tone(
    pixels: NDArray[np.floating], corners: Array, greys: tuple[float, ...] | None = None
) -> ChartTone:
    """Measure the curve of a photo (h, w, 3), encoded 0..1.

    corners: (4, 2) pixels, centres of dark skin, bluish green, black and white of a ColorChecker
    Classic; or, with greys given (reflectances), (2, 2): the first and the last patch of a scale.
    The curve runs through the patches (monotone cubic in the logarithms); below the darkest it is
    proportional to the sRGB-decoded value, above the lightest it goes on as it ended.
    Raises PatinaError where the patches are not there or not in order.
    """
    if greys is None:
        centres, step = _colorchecker(corners)
        reflectance = np.array(COLORCHECKER_GREYS)
    else:
        reflectance = np.array(greys)
        along = np.linspace(0.0, 1.0, len(greys))[:, None]
        centres = corners[0] * (1 - along) + corners[1] * along
        step = float(np.linalg.norm(corners[1] - corners[0])) / (len(greys) - 1)
    found, scatter = _patches(pixels, centres, PATCH * step)
    order = np.argsort(reflectance)
    found, scatter, reflectance = found[order], scatter[order], reflectance[order]
    notes = []
    whole = (found < TOP).all(axis=1) & (found > 0.002).all(axis=1)
    if not whole.all():
        notes.append(f"{int((~whole).sum())} grey patches are clipped and left out")
    found, reflectance = found[whole], reflectance[whole]
    if len(found) < 3:
        raise PatinaError(
            f"{len(found)} grey patches of the chart are neither clipped nor black, expected at "
            "least 3: expose the chart less, or check its corners"
        )
    if (np.diff(found, axis=0) <= 0).any():
        raise PatinaError(
            "the grey patches of the chart do not get lighter in their order: check its corners "
            "(centres of the patches dark skin, bluish green, black, white)"
        )
    if np.median(scatter) > NOT_EVEN:
        notes.append("the chart's patches are not even: is the photo sharp, are the corners right?")
    curves = [_curve(found[:, c], reflectance) for c in range(3)]
    at = curves[0][0]
    linear = np.stack([values for _, values in curves])
    transfer = Transfer.sampled(np.stack([at] * 3), linear, name="chart")
    slope = np.diff(np.log(reflectance))[:, None] / np.diff(np.log(SRGB(found)), axis=0)
    return ChartTone(transfer, found, reflectance, slope.mean(axis=0), tuple(notes))


def _colorchecker(corners: Array) -> tuple[Array, float]:
    """((6, 2) centres of the grey patches, white to black, the distance between patches).

    A plane seen in perspective: the homography that takes the corners of the 3 × 5 lattice there.
    """
    lattice = np.array([[0, 0], [COLUMNS - 1, 0], [COLUMNS - 1, ROWS - 1], [0, ROWS - 1]], float)
    rows = []
    for (x, y), (u, v) in zip(lattice, corners, strict=True):
        rows.append([x, y, 1, 0, 0, 0, -u * x, -u * y, -u])
        rows.append([0, 0, 0, x, y, 1, -v * x, -v * y, -v])
    homography = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    grey = np.stack([np.arange(COLUMNS), np.full(COLUMNS, ROWS - 1.0), np.ones(COLUMNS)], axis=1)
    seen = grey @ homography.T
    centres = seen[:, :2] / seen[:, 2:]
    return centres, float(np.linalg.norm(np.diff(centres, axis=0), axis=1).min())


def _patches(pixels: NDArray[np.floating], centres: Array, half: float) -> tuple[Array, Array]:
    """((n, 3) median of each patch, (n,) its scatter relative to that)."""
    side = max(int(half), 1)
    height, width = pixels.shape[:2]
    values, scatter = [], []
    for x, y in np.round(centres - 0.5).astype(int):
        if not (side <= x < width - side and side <= y < height - side):
            raise PatinaError(
                f"a patch of the chart at ({x}, {y}) lies outside the photo of {width} × {height} "
                "pixels: check its corners"
            )
        part = pixels[y - side : y + side + 1, x - side : x + side + 1].reshape(-1, 3)
        middle = np.median(part, axis=0)
        spread = 1.4826 * np.median(np.abs(part - middle), axis=0)
        values.append(middle)
        scatter.append(float((spread / np.maximum(middle, 1e-3)).max()))
    return np.array(values, np.float64), np.array(scatter)


def _curve(encoded: Array, reflectance: Array) -> tuple[Array, Array]:
    """Points of one channel's curve: (encoded 0..1, linear)."""
    at = np.linspace(0.0, 1.0, POINTS)
    log_s = np.log(np.maximum(SRGB(at), 1e-9))
    known_s, known_r = np.log(SRGB(encoded)), np.log(reflectance)
    inner = PchipInterpolator(known_s, known_r)
    low = known_r[0] + (log_s - known_s[0])  # proportional: nothing darker was measured
    last = float(inner.derivative()(known_s[-1]))
    steep = (known_r[-1] - known_r[-2]) / (known_s[-1] - known_s[-2])
    high = known_r[-1] + max(last, steep) * (log_s - known_s[-1])
    clipped = np.clip(log_s, known_s[0], known_s[-1])
    log_r = np.where(log_s < known_s[0], low, np.where(log_s > known_s[-1], high, inner(clipped)))
    linear = np.exp(log_r)
    linear[0] = 0.0
    return at, linear
