"""A PhotoView as a drawing with labels: photo and prediction, or where samples came from."""

from __future__ import annotations

import textwrap

import numpy as np
from numpy.typing import NDArray

from .criteria import LOOKS
from .drawing import INK, Drawing, Label, Part, Picture, box, named
from .photo_pictures import FULL_COLOUR, compared, criteria_picture
from .photo_view import PhotoView

KINDS = ("comparison", "samples")
# longer side of a picture in the drawing: of three side by side, and of a single one
COMPARISON_SIDE, SAMPLES_SIDE = 300.0, 460.0
TOP, GAP, LINE = 20.0, 10.0, 15.0
PIXELS = 2  # pixels of a picture per unit of the drawing
KEY, LETTERS = 250.0, 44  # width of the legend, letters in a line of advice


def photo_drawing(view: PhotoView, kind: str, exposure: float = 0.0) -> Drawing:
    """kind: one of KINDS; exposure: in stops, for the comparison only."""
    return _comparison(view, exposure) if kind == "comparison" else _samples(view)


def _comparison(view: PhotoView, exposure: float) -> Drawing:
    pictures = compared(view, round(COMPARISON_SIDE * PIXELS), exposure)
    titles = (f"{view.name}: photo", "prediction", "difference")
    parts: list[Part] = []
    left = GAP
    for title, pixels in zip(titles, pictures, strict=True):
        height, width = _size(pixels, COMPARISON_SIDE)
        parts.append(Label(left, TOP - 7, title, colour=INK))
        parts.append(Picture(left, TOP, width, height, pixels))
        left += width + GAP
    bottom = TOP + height + LINE
    errors = f"RMS error {100 * view.error:.0f} %, highlights and edges included"
    if np.isfinite(view.typical):
        errors = f"median error {100 * view.typical:.0f} % · {errors}"
    if exposure:
        errors += f" · exposure {exposure:+.1f} stops"
    parts.append(Label(GAP, bottom, errors))
    full = f"blue: prediction too dark, red: too bright, full at {100 * FULL_COLOUR:.0f} % of white"
    parts.append(Label(GAP, bottom + LINE, full))
    return Drawing(left, bottom + LINE + 8, f"{view.name} and its prediction", tuple(parts))


def _size(pixels: NDArray[np.uint8], longest: float) -> tuple[float, float]:
    """(height, width) in the drawing of a picture whose longer side is ``longest``."""
    height, width = (n * longest / max(pixels.shape[:2]) for n in pixels.shape[:2])
    return height, width


def _samples(view: PhotoView) -> Drawing:
    """The picture of the criteria with a legend: the largest share first, with advice."""
    pixels = criteria_picture(view, round(SAMPLES_SIDE * PIXELS))
    height, width = _size(pixels, SAMPLES_SIDE)
    parts: list[Part] = [
        Label(GAP, TOP - 7, f"{view.name}: where samples came from", colour=INK),
        Picture(GAP, TOP, width, height, pixels),
    ]
    left, y = width + 2 * GAP, TOP + 10
    for criterion, share in sorted(view.shares.items(), key=lambda item: -item[1]):
        look = LOOKS[criterion]
        percent = f"{100 * share:.0f} %" if share >= 0.01 else "< 1 %"
        parts.append(box(left, y - 9, left + 10, y + 1, named(look.colour)))
        parts.append(Label(left + 15, y, f"{percent} {look.word}", colour=INK))
        for line in textwrap.wrap(look.advice, LETTERS):
            y += LINE - 3
            parts.append(Label(left + 15, y, line, size=8.5))
        y += LINE + 5
    if len(view.chosen):
        rings = f"Rings: pixels that the fit uses ({len(view.chosen)})"
        parts.append(Label(left, y, rings, colour=INK))
        y += LINE
    return Drawing(left + KEY, max(TOP + height, y) + GAP, "where samples came from", tuple(parts))
