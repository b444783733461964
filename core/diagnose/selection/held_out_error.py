"""How well held-out regions of the photos are predicted, in measures for the user."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..solver.model_fit import ModelFit
from ..solver.residual_scale import NORMAL
from .cross_validation import HeldOutPrediction, predict_held_out_photos
from .relative_change import relative_rms_change

Array = NDArray[np.floating]


@dataclass(frozen=True)
class HeldOutErrors:
    """parts, photos: RMS error of held-out regions and of held-out photos, relative to the radiance
    of the photos, clipped at white (relative_change.py); photos: None if there is only one.
    over_floor: the typical (median) error of held-out regions divided by the error expected from
    photo noise and the known errors of the scan. not_noise: fraction of the typical squared error
    that is not photo noise."""

    parts: float
    photos: float | None
    over_floor: float
    not_noise: float


def held_out_errors(
    fitted: ModelFit, held_out: HeldOutPrediction, expected: Array
) -> HeldOutErrors:
    """held_out: prediction of held-out regions; expected: (n, 3) standard deviation before anything
    was fitted."""
    noise = np.sqrt(fitted.model.pixels.noise)
    return HeldOutErrors(
        held_out_rms(fitted, held_out),
        held_out_photo_error(fitted),
        _typical(fitted, held_out, expected),
        max(0.0, 1 - 1 / max(_typical(fitted, held_out, noise), 1e-9) ** 2),
    )


def held_out_photo_error(fitted: ModelFit) -> float | None:
    """RMS error of held-out photos, relative to their radiance clipped at white; None if there is
    only one photo."""
    whole = predict_held_out_photos(fitted)
    return None if whole is None else held_out_rms(fitted, whole)


def _typical(fitted: ModelFit, held_out: HeldOutPrediction, unit: Array) -> float:
    """Median error in units (n, 3) of each pixel, divided by the median of a standard normal: 1 if
    the errors are normally distributed with these standard deviations."""
    good = np.isfinite(fitted.deviation)
    error = np.abs(held_out.residual[good] * fitted.deviation[good] / unit[good])
    return float(np.median(error)) / NORMAL if len(error) else 0.0


def held_out_rms(fitted: ModelFit, held_out: HeldOutPrediction) -> float:
    """RMS error of a held-out prediction, relative to the photos' radiance clipped at white."""
    observed = fitted.model.pixels.observed
    error = held_out.residual * np.where(np.isfinite(fitted.deviation), fitted.deviation, 0)
    return relative_rms_change(observed, observed - error, fitted.deviation)
