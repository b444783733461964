"""The expected standard deviation of the residual of a pixel without any cause.

It includes the noise model of a pixel (core/noise), the error of the scan's normals as estimated by
the fit, and the misalignment of photos at shadow edges and image edges. It is fixed before any
cause is tried, so that the costs of different causes are comparable.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ...noise.pixel_error import bright_parts, pixel_variance
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.pixels import Pixels
from .model import Model

Array = NDArray[np.floating]

TILT_STEP = 2e-3  # radians, for difference quotients
POSE_ERROR = 0.15  # pixels, of the camera poses of a good scan
LEVELS, MIN_PIXELS = 8, 50  # bins of brightness; pixels that a bin needs
NORMAL = 0.6745  # median of a normal distribution's magnitude
EDGE_DISTANCE = 2.0  # pixels from a shadow edge within which a pixel may be on the other side


def expected_deviation(pixels: Pixels, brdfs: MaterialBRDFs, normal_deviation: float) -> Array:
    """(n, 3) standard deviation of radiance, inf for clipped pixels; normal_deviation: radians
    along each tangent."""
    model = Model(pixels, brdfs)
    state = model.shading()
    predicted = model.reflected([state])
    bright = bright_parts(predicted.mean(axis=1), pixels.photo)
    variance = pixel_variance(pixels.noise, predicted, bright[pixels.photo, None])
    variance += np.square(normal_deviation) * _by_normals(model, predicted)
    variance += POSE_ERROR**2 * np.sum(pixels.slope.astype(np.float64) ** 2, axis=1)
    nearness = np.clip(1 - pixels.edge / EDGE_DISTANCE, 0, 1)[:, None]
    full = brdfs.evaluate(state.angles, pixels.material) * state.irradiance * state.cos_i[:, None]
    variance += (0.5 * nearness * full) ** 2
    out = np.sqrt(variance)
    out[~pixels.usable] = np.inf
    return np.asarray(out)


def rescaled_deviation(
    deviation: Array, residual: Array, predicted: Array, pixels: Pixels
) -> Array:
    """The standard deviation rescaled to the residuals of the model without effects, by brightness
    and material, but never below the photos' noise.

    residual: (n, 3) in units of the deviation; predicted: (n, 3). If it were too small, errors of
    the model would look like evidence for any effect; if too large, no small effect would be found.
    """
    out = deviation.copy()
    level = predicted.mean(axis=1)
    for material in np.unique(pixels.material):
        rows = np.flatnonzero((pixels.material == material) & np.isfinite(deviation).all(axis=1))
        for part in np.array_split(rows[np.argsort(level[rows], kind="stable")], LEVELS):
            if len(part) >= MIN_PIXELS:
                scale = np.median(np.abs(residual[part]), axis=0) / NORMAL
                out[part] *= np.maximum(scale, 1e-3)
    return np.maximum(out, np.sqrt(pixels.noise))


def _by_normals(model: Model, predicted: Array) -> Array:
    """(n, 3) sum over two tangents of the squared derivative of radiance by the tilt of the
    normal."""
    normal = model.pixels.normal.astype(np.float64)
    out = np.zeros_like(predicted, dtype=np.float64)
    state = model.shading()
    for tangent in tangents(normal):
        tilted = replace(state, normal=(normal + TILT_STEP * tangent).astype(np.float32))
        out += ((model.reflected([tilted]) - predicted) / TILT_STEP) ** 2
    return out
