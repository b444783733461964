"""Pictures of a PhotoView: photo, prediction, difference; and where samples came from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..samples import Criterion
from . import display
from .criteria import PALETTE, SPARE
from .photo_view import PhotoView

FULL_COLOUR = 0.3  # difference, of what is shown as white
GAP = 6  # pixels between pictures
TINT = 0.65  # how much of a pixel's colour is its criterion's, and not the photo's
DIMMED = 0.45  # the photo where there is no surface
RINGED = 100  # chosen pixels up to which each gets a ring
RING, LINE = 6.0, 1.1  # pixels of the picture: radius, and half the width of a line

Picture = NDArray[np.uint8]


class Comparison(NamedTuple):
    """(h, w, 3) sRGB each. difference: signed, prediction too dark blue, too bright red."""

    photo: Picture
    prediction: Picture
    difference: Picture


def compared(view: PhotoView, longest: int, exposure: float = 0.0) -> Comparison:
    """Photo and prediction at one exposure, so many stops above the usual; no side longer than
    ``longest`` pixels."""
    white = view.white / 2.0**exposure
    photo, prediction = (display.shrink(p, longest) for p in (view.measured, view.predicted))
    return Comparison(
        display.photo_picture(photo, white),
        display.photo_picture(prediction, white),
        display.difference_picture(prediction, photo, FULL_COLOUR * white),
    )


def comparison_picture(view: PhotoView, longest: int, exposure: float = 0.0) -> Picture:
    """(h, w, 3) photo | prediction | difference side by side; none longer than ``longest``."""
    first, *others = compared(view, longest, exposure)
    gap = np.full((len(first), GAP, 3), display.UNKNOWN, np.uint8)
    return np.concatenate([first, *(p for other in others for p in (gap, other))], axis=1)


def criteria_picture(view: PhotoView, longest: int) -> Picture:
    """(h, w, 3) the colours of the criteria over the photo in grey; no side longer than
    ``longest`` pixels. A handful of chosen pixels is ringed; of very many, the reliable ones that
    were not chosen are paler."""
    few = len(view.chosen) <= RINGED
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
    """(h, w, 3) the colours, paler where a reliable pixel is not among the chosen."""
    colours = PALETTE[view.criteria]
    spare = view.criteria == Criterion.RELIABLE
    rows, columns = view.chosen.T
    spare[rows, columns] = False
    colours[spare] = SPARE
    return colours


def _ring(picture: Picture, row: float, column: float) -> None:
    """A white ring with a black rim around a place, drawn into (h, w, 3)."""
    reach = RING + 3 * LINE + 1
    top, left = max(0, int(row - reach)), max(0, int(column - reach))
    part = picture[top : int(row + reach) + 1, left : int(column + reach) + 1]
    rows, columns = np.indices(part.shape[:2]) + 0.5
    away = np.abs(np.hypot(rows + top - row, columns + left - column) - RING)[..., None]
    for level, width in ((0.0, 2 * LINE), (255.0, LINE)):
        cover = np.clip(width + 0.5 - away, 0.0, 1.0)
        part[:] = part + cover * (level - part) + 0.5
