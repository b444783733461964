"""How well left-out parts of the photos are predicted, in words that a user knows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .change import rms_change
from .deviation import NORMAL
from .fitted import Fitted
from .held_out import Unseen, predict_unseen_photos

Array = NDArray[np.floating]


@dataclass(frozen=True)
class UnseenError:
    """parts, photos: RMS error of left-out squares and of left-out photos, relative to what the
    photos show up to white; photos: None of one photo. over_floor: the typical error of left-out
    squares over what noise of the photos and the scan's known errors would make. not_noise: part of
    the typical squared error that the photos' own noise does not make."""

    parts: float
    photos: float | None
    over_floor: float
    not_noise: float


def unseen_error(fitted: Fitted, unseen: Unseen, expected: Array) -> UnseenError:
    """unseen: of left-out squares; expected: (n, 3) deviation before anything was fitted."""
    noise = np.sqrt(fitted.model.pixels.noise)
    return UnseenError(
        _rms(fitted, unseen),
        unseen_photos_error(fitted),
        _typical(fitted, unseen, expected),
        max(0.0, 1 - 1 / max(_typical(fitted, unseen, noise), 1e-9) ** 2),
    )


def unseen_photos_error(fitted: Fitted) -> float | None:
    """RMS error of left-out photos, relative to what the photos show up to white; None of one."""
    whole = predict_unseen_photos(fitted)
    return None if whole is None else _rms(fitted, whole)


def _typical(fitted: Fitted, unseen: Unseen, unit: Array) -> float:
    """Error in a unit (n, 3) of each pixel; 1 where the errors are normal and that large."""
    good = np.isfinite(fitted.deviation)
    missed = np.abs(unseen.residual[good] * fitted.deviation[good] / unit[good])
    return float(np.median(missed)) / NORMAL if len(missed) else 0.0


def _rms(fitted: Fitted, unseen: Unseen) -> float:
    observed = fitted.model.pixels.observed
    missed = unseen.residual * np.where(np.isfinite(fitted.deviation), fitted.deviation, 0)
    return rms_change(observed, observed - missed, fitted.deviation)
