"""A drawing as a list of parts, so that a page (svg.py) and Blender (raster.py) show the same one.

Coordinates: pixels at scale 1, x to the right, y downwards from the top left corner. Colours:
"#rrggbb". Parts lie over those before them; labels over everything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

INK, GREY, GRID = "#333944", "#666b77", "#d9dde6"
FONT = 10.0


@dataclass(frozen=True)
class Line:
    """Through points (n, 2). dash: lengths drawn and left out, None: whole."""

    points: NDArray[np.floating]
    colour: str
    width: float = 1.0
    dash: tuple[float, float] | None = None


@dataclass(frozen=True)
class Area:
    """Inside a closed outline (n, 2)."""

    points: NDArray[np.floating]
    colour: str
    opacity: float = 1.0


@dataclass(frozen=True)
class Dots:
    """Discs at points (n, 2). colours: (n, 3) uint8."""

    points: NDArray[np.floating]
    colours: NDArray[np.uint8]
    radius: float = 1.2
    opacity: float = 1.0


@dataclass(frozen=True)
class Picture:
    """Pixels (h, w, 3) uint8 in a rectangle."""

    left: float
    top: float
    width: float
    height: float
    pixels: NDArray[np.uint8]


@dataclass(frozen=True)
class Label:
    """Text on a baseline. anchor: which end of the text is at x: "start", "middle" or "end"."""

    x: float
    y: float
    text: str
    anchor: str = "start"
    colour: str = GREY
    size: float = FONT


Part = Line | Area | Dots | Picture | Label


@dataclass(frozen=True)
class Drawing:
    """label: what it is, for those who do not see it."""

    width: float
    height: float
    label: str
    parts: tuple[Part, ...]


def straight(
    x1: float, y1: float, x2: float, y2: float, colour: str = GRID, width: float = 1.0
) -> Line:
    """A line between two points."""
    return Line(np.array([[x1, y1], [x2, y2]]), colour, width)


def box(left: float, top: float, right: float, bottom: float, colour: str) -> Area:
    """A filled rectangle."""
    corners = [[left, top], [right, top], [right, bottom], [left, bottom]]
    return Area(np.array(corners, float), colour)


def rgb(colour: str) -> NDArray[np.uint8]:
    """(3,) of a "#rrggbb"."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], np.uint8)


def named(colour: Sequence[int] | NDArray[np.integer]) -> str:
    """The "#rrggbb" of (3,) 0 … 255."""
    return "#" + "".join(f"{int(c):02x}" for c in colour)
