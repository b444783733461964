"""A drawing as a list of parts: svg.py writes it for HTML, raster.py renders it for Blender.

Coordinates: pixels at scale 1, x to the right, y downwards from the top left corner. Colours:
"#rrggbb". Later parts cover earlier ones; labels cover everything.
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
    """A line through points (n, 2). dash: lengths of dashes and gaps, None for a solid line."""

    points: NDArray[np.floating]
    colour: str
    width: float = 1.0
    dash: tuple[float, float] | None = None


@dataclass(frozen=True)
class Area:
    """A filled polygon with the closed outline (n, 2)."""

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
    """An image (h, w, 3) uint8, scaled to a rectangle."""

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
    """A complete drawing. label: a description for screen readers."""

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
    """(3,) 0 … 255 of a colour "#rrggbb"."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], np.uint8)


def named(colour: Sequence[int] | NDArray[np.integer]) -> str:
    """The colour (3,) 0 … 255 as "#rrggbb"."""
    return "#" + "".join(f"{int(c):02x}" for c in colour)
