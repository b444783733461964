"""Pictures of the residual of a photo."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..diagnose.forward.pixels import Pixels
from ..diagnose.selection.diagnosis import Diagnosis, Trial
from ..diagnose.solver.model_fit import ModelFit
from ..views import display

LONGEST = 260  # pixels, of the longer side in a report
MAX_DISTANCE = 3.0  # of a shown place to the nearest selected pixel, in their typical spacing
NEIGHBOURS = 5  # pixels that are averaged at a place
SOFTNESS = (
    0.3  # of the weights, in the typical spacing: at the pixel itself it outweighs the others
)
WHITE_PERCENTILE = 99.0  # of the radiance of a photo, shown as white
FULL = 3.0  # standard deviations, for full colour


def scaled_residual(found: Diagnosis, fitted: ModelFit) -> NDArray[np.floating]:
    """(n, 3) photo minus the prediction of one of the diagnosis's fits, in the standard deviations
    of the first fit, so that colours compare."""
    with np.errstate(invalid="ignore"):  # pixels that do not count have none: inf / inf
        return np.asarray(fitted.residual * (fitted.deviation / found.before.deviation))


def change_by(found: Diagnosis, trial: Trial) -> NDArray[np.floating]:
    """(n, 3) the change of the photos by a cause, in the same standard deviations."""
    return np.asarray(trial.changed() / found.before.deviation)


def white_of(pixels: Pixels, photo: int) -> float:
    """The radiance of a photo that is shown as white."""
    return float(np.percentile(pixels.observed[pixels.photo == photo], WHITE_PERCENTILE))


def photo_most_changed(pixels: Pixels, changed: NDArray[np.floating]) -> int | None:
    """Index of the photo with the largest mean square change per pixel; None where nothing changes.
    changed: (n, 3) in standard deviations."""
    strength = np.bincount(pixels.photo, np.sum(changed**2, axis=1))
    if not strength.any():
        return None
    return int(np.argmax(strength / np.maximum(np.bincount(pixels.photo), 1)))


def residual_picture(
    pixels: Pixels, residual: NDArray[np.floating], photo: int, longest: int = LONGEST
) -> NDArray[np.uint8]:
    """(h, w, 3) picture of the part of a photo that shows the object: blue where the prediction is
    too dark, red where it is too bright, full colour at FULL. residual: (n, 3) photo − prediction
    in standard deviations; longest: pixels of the longer side."""
    image = _interpolated(pixels, residual.mean(axis=1, keepdims=True), photo, longest)
    return display.difference_picture(-image, np.zeros_like(image), FULL)


def radiance_picture(
    pixels: Pixels,
    radiance: NDArray[np.floating],
    photo: int,
    white: float,
    longest: int = LONGEST,
) -> NDArray[np.uint8]:
    """(h, w, 3) picture of the same part of a photo, or of its prediction. radiance: (n, 3); white:
    the radiance shown as white; longest: pixels of the longer side."""
    return display.photo_picture(_interpolated(pixels, radiance, photo, longest), white)


def _interpolated(
    pixels: Pixels, values: NDArray[np.floating], photo: int, longest: int
) -> NDArray[np.float64]:
    """(h, w, c) for each place of the picture the mean of the values (n, c) of the nearest pixels
    of the photo, weighted by their distance; NaN where none is near."""
    mine = pixels.photo == photo
    at = np.stack([pixels.x[mine], pixels.y[mine]], axis=1).astype(np.float64)
    if not len(at):
        return np.full((1, 1, values.shape[1]), np.nan)
    low, high = at.min(axis=0), at.max(axis=0)
    size = float((high - low).max()) or 1.0
    width, height = np.maximum(1, np.ceil(longest * (high - low) / size)).astype(int)
    columns = low[0] + (np.arange(width) + 0.5) * size / longest
    lines = low[1] + (np.arange(height) + 0.5) * size / longest
    grid = np.stack(np.meshgrid(columns, lines), axis=-1).reshape(-1, 2)
    rows = np.flatnonzero(mine & np.isfinite(values).all(axis=1))
    shown = np.full((len(grid), values.shape[1]), np.nan)
    if len(rows):
        typical = np.sqrt(np.prod(np.maximum(high - low, 1e-9)) / len(at))
        places = np.stack([pixels.x[rows], pixels.y[rows]], axis=1).astype(np.float64)
        limit = MAX_DISTANCE * typical
        far, which = cKDTree(places).query(grid, min(NEIGHBOURS, len(rows)), 0, 2, limit)
        far, which = far.reshape(len(grid), -1), which.reshape(len(grid), -1)
        known = np.isfinite(far[:, 0])
        weight = 1 / (far[known] ** 2 + (SOFTNESS * typical) ** 2)  # 0 where there is none
        nearest = values[rows[np.minimum(which[known], len(rows) - 1)]]
        weight /= weight.sum(axis=1, keepdims=True)
        shown[known] = np.einsum("mk,mkc->mc", weight, nearest)
    return shown.reshape(height, width, -1)
