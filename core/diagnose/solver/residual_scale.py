"""How far a pixel may be from a perfect prediction for reasons that need no cause.

Photo noise; the scan's normals, as far as the fit found them to be off; half a pixel at edges of
shadows and of what the photo shows; and a part of the prediction that no model gets better. Fixed
before any cause is tried, so that the costs of different causes compare.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.pixels import Pixels
from .model import Model

Array = NDArray[np.floating]

FLOOR = 0.015  # of the prediction
DARK = 0.004  # of a photo's bright pixels
NUDGE = 2e-3  # radians
MISPLACED = 0.15  # pixels, what a good scan's poses are off by
LEVELS, FEW = 8, 50  # of brightness; pixels that tell
NORMAL = 0.6745  # median of a normal distribution's magnitude
BESIDE = 2.0  # pixels from a shadow's edge where the mesh does not know on which side they are


def expected_deviation(pixels: Pixels, brdfs: MaterialBRDFs, normal_deviation: float) -> Array:
    """(n, 3) radiance, inf for clipped pixels; normal_deviation: radians along each tangent."""
    model = Model(pixels, brdfs)
    state = model.shading()
    predicted = model.reflected([state])
    bright = np.zeros(int(pixels.photo.max()) + 1)
    for photo in np.unique(pixels.photo):
        bright[photo] = np.percentile(predicted[pixels.photo == photo].mean(axis=1), 90)
    variance = pixels.noise.astype(np.float64)
    variance += (FLOOR * predicted) ** 2 + (DARK * bright[pixels.photo, None]) ** 2
    variance += np.square(normal_deviation) * _by_normals(model, predicted)
    variance += MISPLACED**2 * np.sum(pixels.slope.astype(np.float64) ** 2, axis=1)
    beside = np.clip(1 - pixels.edge / BESIDE, 0, 1)[:, None]
    full = brdfs.evaluate(state.angles, pixels.material) * state.irradiance * state.cos_i[:, None]
    variance += (0.5 * beside * full) ** 2
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
            if len(part) >= FEW:
                scale = np.median(np.abs(residual[part]), axis=0) / NORMAL
                out[part] *= np.maximum(scale, 1e-3)
    return np.maximum(out, np.sqrt(pixels.noise))


def _by_normals(model: Model, predicted: Array) -> Array:
    """(n, 3) sum over two tangents of the squared slope of radiance."""
    normal = model.pixels.normal.astype(np.float64)
    out = np.zeros_like(predicted, dtype=np.float64)
    state = model.shading()
    for tangent in tangents(normal):
        moved = replace(state, normal=(normal + NUDGE * tangent).astype(np.float32))
        out += ((model.reflected([moved]) - predicted) / NUDGE) ** 2
    return out
