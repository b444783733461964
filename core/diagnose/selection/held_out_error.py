"""How well left-out parts of the photos are predicted, in words that a user knows."""

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
    """parts, photos: RMS error of left-out squares and of left-out photos, relative to what the
    photos show up to white; photos: None of one photo. over_floor: the typical error of left-out
    squares over what noise of the photos and the scan's known errors would make. not_noise: part of
    the typical squared error that the photos' own noise does not make."""

    parts: float
    photos: float | None
    over_floor: float
    not_noise: float


def held_out_errors(fitted: ModelFit, unseen: HeldOutPrediction, expected: Array) -> HeldOutErrors:
    """unseen: of left-out squares; expected: (n, 3) deviation before anything was fitted."""
    noise = np.sqrt(fitted.model.pixels.noise)
    return HeldOutErrors(
        _rms(fitted, unseen),
        held_out_photo_error(fitted),
        _typical(fitted, unseen, expected),
        max(0.0, 1 - 1 / max(_typical(fitted, unseen, noise), 1e-9) ** 2),
    )


def held_out_photo_error(fitted: ModelFit) -> float | None:
    """RMS error of left-out photos, relative to what the photos show up to white; None of one."""
    whole = predict_held_out_photos(fitted)
    return None if whole is None else _rms(fitted, whole)


def _typical(fitted: ModelFit, unseen: HeldOutPrediction, unit: Array) -> float:
    """Error in a unit (n, 3) of each pixel; 1 where the errors are normal and that large."""
    good = np.isfinite(fitted.deviation)
    missed = np.abs(unseen.residual[good] * fitted.deviation[good] / unit[good])
    return float(np.median(missed)) / NORMAL if len(missed) else 0.0


def _rms(fitted: ModelFit, unseen: HeldOutPrediction) -> float:
    observed = fitted.model.pixels.observed
    missed = unseen.residual * np.where(np.isfinite(fitted.deviation), fitted.deviation, 0)
    return relative_rms_change(observed, observed - missed, fitted.deviation)
