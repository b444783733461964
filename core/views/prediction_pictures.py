"""A photo, its prediction and their signed difference as pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..jobs.photo_prediction import PhotoPrediction
from ..predict.flip import flip_error
from .display import UNKNOWN, difference_picture, photo_picture, white_level

DIFFERENCE_SCALE = 0.25  # encoded difference with the full colour

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class PredictionPictures:
    """(h, w, 3) sRGB pictures of a photo of h × w pixels. Integer formats are shown as they are
    encoded; linear floating-point formats with ``white`` as 1 and the sRGB curve. difference: blue
    too dark, red too bright, full colour at ± DIFFERENCE_SCALE (of white). The prediction is grey
    where no surface is seen."""

    photo: Picture
    prediction: Picture
    difference: Picture
    white: float

    @classmethod
    def of(cls, found: PhotoPrediction) -> PredictionPictures:
        """The pictures of one prediction."""
        if found.bounded:
            photo, prediction = (_eight_bit(e) for e in (found.measured, found.encoded))
            white = 1.0
        else:
            white = white_level(found.measured[found.compared])
            photo, prediction = (photo_picture(e, white) for e in (found.measured, found.encoded))
        difference = difference_picture(found.encoded, found.measured, DIFFERENCE_SCALE * white)
        return cls(photo, prediction, difference, white)

    def flip(self, compared: NDArray[np.bool_]) -> float | None:
        """Mean FLIP error of the pixels ``compared`` (h, w); see flip_error."""
        return flip_error(self.prediction, self.photo, compared)


def _eight_bit(encoded: NDArray[np.floating]) -> Picture:
    """Encoded values 0..1 (h, w, 3) as 8-bit ones, UNKNOWN where they are NaN."""
    known = np.isfinite(encoded).all(axis=-1)
    picture = (np.clip(np.nan_to_num(encoded), 0, 1) * 255 + 0.5).astype(np.uint8)
    picture[~known] = UNKNOWN
    return picture
