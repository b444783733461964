"""Tone curve and white balance from a photo of a colour chart or a grey scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from ..errors import PatinaError
from ..photo.transfer import SRGB, Transfer

Array = NDArray[np.float64]

# grey row of the ColorChecker Classic, white to black, from the densities printed on the chart
COLORCHECKER_GREYS = tuple(10.0**-d for d in (0.05, 0.23, 0.44, 0.70, 1.05, 1.50))
ROWS, COLUMNS = 4, 6
PATCH = 0.25  # half the side of the measured square, relative to the distance between patches
CLIPPED = 0.995  # encoded values from here on may be clipped
UNEVEN = 0.08  # relative scatter within a patch above which a note is given
POINTS = 257  # of the sampled curve


@dataclass(frozen=True)
class ChartTone:
    """transfer: encoded → linear; grey patches are neutral, white has its reflectance. encoded,
    reflectance: (n, 3), (n,) of the grey patches used, dark to light. gamma: (3,) mean slope of log
    reflectance over the log of the sRGB-decoded value: 1 where the photo is encoded as sRGB. notes:
    sentences for the report."""

    transfer: Transfer
    encoded: Array
    reflectance: Array
    gamma: Array
    notes: tuple[str, ...]


def chart_tone(
    pixels: NDArray[np.floating], corners: Array, greys: tuple[float, ...] | None = None
) -> ChartTone:
    """Measure the tone curve of a photo (h, w, 3), encoded 0..1.

    corners: (4, 2) pixels, centres of the patches dark skin, bluish green, black and white of a
    ColorChecker Classic; or, with greys given (reflectances), (2, 2): the first and the last patch
    of a grey scale. The curve is a monotone cubic through the patches in the logarithms. Below the
    darkest it is proportional to the sRGB-decoded value, above the lightest it is extrapolated with
    its last slope. Raises PatinaError where patches lie outside the photo, are clipped or are not
    in order.
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
    whole = (found < CLIPPED).all(axis=1) & (found > 0.002).all(axis=1)
    if not whole.all():
        notes.append(
            f"Grey patches of the chart not used, clipped or black: {int((~whole).sum())}."
        )
    found, reflectance = found[whole], reflectance[whole]
    if len(found) < 3:
        raise PatinaError(
            f"{len(found)} grey patches of the chart are neither clipped nor black; expected at "
            "least 3; expose the chart less, or check its corners"
        )
    if (np.diff(found, axis=0) <= 0).any():
        raise PatinaError(
            "the grey patches of the chart are not in order of lightness; check its corners "
            "(centres of the patches dark skin, bluish green, black, white)"
        )
    if np.median(scatter) > UNEVEN:
        notes.append("The chart's patches are not uniform; check its focus and its corners.")
    curves = [_curve(found[:, c], reflectance) for c in range(3)]
    at = curves[0][0]
    linear = np.stack([values for _, values in curves])
    transfer = Transfer.sampled(np.stack([at] * 3), linear, name="chart")
    slope = np.diff(np.log(reflectance))[:, None] / np.diff(np.log(SRGB(found)), axis=0)
    return ChartTone(transfer, found, reflectance, slope.mean(axis=0), tuple(notes))


def _colorchecker(corners: Array) -> tuple[Array, float]:
    """((6, 2) centres of the grey patches, white to black, the distance between patches).

    The chart is a plane in perspective: a homography maps the corners of the 3 × 5 lattice to the
    photo.
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
    """((n, 3) median of each patch, (n,) its relative scatter)."""
    side = max(int(half), 1)
    height, width = pixels.shape[:2]
    values, scatter = [], []
    for x, y in np.round(centres - 0.5).astype(int):
        if not (side <= x < width - side and side <= y < height - side):
            raise PatinaError(
                f"a patch of the chart at ({x}, {y}) lies outside the photo of {width} × {height} "
                "pixels; check the corners of the chart"
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
    low = known_r[0] + (log_s - known_s[0])  # proportional: no darker patch was measured
    last = float(inner.derivative()(known_s[-1]))
    steep = (known_r[-1] - known_r[-2]) / (known_s[-1] - known_s[-2])
    high = known_r[-1] + max(last, steep) * (log_s - known_s[-1])
    clipped = np.clip(log_s, known_s[0], known_s[-1])
    log_r = np.where(log_s < known_s[0], low, np.where(log_s > known_s[-1], high, inner(clipped)))
    linear = np.exp(log_r)
    linear[0] = 0.0
    return at, linear
