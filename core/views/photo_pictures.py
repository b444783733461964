"""Images of a PhotoView: photo, prediction and difference, and where samples came from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..samples import Criterion
from . import display
from .criteria import PALETTE, UNSELECTED
from .photo_view import PhotoView

FULL_COLOUR = 0.3  # difference shown in full colour, relative to the radiance shown as white
GAP = 6  # pixels between pictures
TINT = 0.65  # share of the criterion's colour; the rest is the photo in grey
DIMMED = 0.45  # brightness factor of the photo where there is no surface
MAX_RINGS = 100  # selected pixels that are marked with rings; more are marked by colour
RING, LINE = 6.0, 1.1  # pixels of the picture: radius of a ring and half the width of its line

Picture = NDArray[np.uint8]


class Comparison(NamedTuple):
    """(h, w, 3) sRGB each. difference: blue where the prediction is too dark, red where it is too
    bright."""

    photo: Picture
    prediction: Picture
    difference: Picture


def compared(view: PhotoView, longest: int, exposure: float = 0.0) -> Comparison:
    """Photo, prediction and difference at the same exposure. exposure: stops above the default;
    longest: the largest side in pixels."""
    white = view.white / 2.0**exposure
    photo, prediction = (display.shrink(p, longest) for p in (view.measured, view.predicted))
    return Comparison(
        display.photo_picture(photo, white),
        display.photo_picture(prediction, white),
        display.difference_picture(prediction, photo, FULL_COLOUR * white),
    )


def comparison_picture(view: PhotoView, longest: int, exposure: float = 0.0) -> Picture:
    """(h, w, 3) photo | prediction | difference side by side; longest: largest side of each."""
    first, *others = compared(view, longest, exposure)
    gap = np.full((len(first), GAP, 3), display.UNKNOWN, np.uint8)
    return np.concatenate([first, *(p for other in others for p in (gap, other))], axis=1)


def criteria_picture(view: PhotoView, longest: int) -> Picture:
    """(h, w, 3) the colours of the criteria over the photo in grey; longest: the largest side in
    pixels. Up to MAX_RINGS selected pixels get rings; if there are more, the reliable pixels that
    were not selected are paler."""
    few = len(view.chosen) <= MAX_RINGS
    colours = display.shrink(PALETTE[view.criteria] if few else _with_spare(view), longest)
    surface = display.shrink((view.criteria != Criterion.NO_SURFACE).astype(np.float32), longest)
    photo = display.photo_picture(display.shrink(view.measured, longest), view.white)
    grey = photo.mean(axis=-1, dtype=np.float32)[..., None]
    tint = TINT * surface[..., None]
    dimmed = grey * (DIMMED + (1 - DIMMED) * surface[..., None])
    picture = (tint * colours + (1 - tint) * dimmed + 0.5).astype(np.uint8)
    if few:
        factor = display.shrink_factor(view.criteria.shape, longest)
        for row, column in (view.chosen + 0.5) / factor:
            _ring(picture, row, column)
    return picture


def _with_spare(view: PhotoView) -> Picture:
    """(h, w, 3) the colours of the criteria, paler for reliable pixels that are not selected."""
    colours = PALETTE[view.criteria]
    spare = view.criteria == Criterion.RELIABLE
    rows, columns = view.chosen.T
    spare[rows, columns] = False
    colours[spare] = UNSELECTED
    return colours


def _ring(picture: Picture, row: float, column: float) -> None:
    """Draw a white ring with a black rim around a position into the picture (h, w, 3)."""
    reach = RING + 3 * LINE + 1
    top, left = max(0, int(row - reach)), max(0, int(column - reach))
    part = picture[top : int(row + reach) + 1, left : int(column + reach) + 1]
    rows, columns = np.indices(part.shape[:2]) + 0.5
    away = np.abs(np.hypot(rows + top - row, columns + left - column) - RING)[..., None]
    for level, width in ((0.0, 2 * LINE), (255.0, LINE)):
        cover = np.clip(width + 0.5 - away, 0.0, 1.0)
        part[:] = part + cover * (level - part) + 0.5
