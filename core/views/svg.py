"""A drawing as an SVG element for an HTML page."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from .drawing import FONT, GREY, Area, Dots, Drawing, Label, Line, Part, named

FAMILY = "system-ui,sans-serif"


def svg(drawing: Drawing) -> str:
    """The complete SVG element. Pictures are omitted: a page refers to them as separate files."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {drawing.width:g} '
        f'{drawing.height:g}" role="img" aria-label="{escape(drawing.label)}">',
        f"<style>text{{font:{FONT:g}px {FAMILY};fill:{GREY}}}</style>",
    ]
    labels = [part for part in drawing.parts if isinstance(part, Label)]
    others = [part for part in drawing.parts if not isinstance(part, Label)]
    parts += [_element(part) for part in (*others, *labels)]
    return "".join(parts) + "</svg>"


def _element(part: Part) -> str:
    if isinstance(part, Line):
        dash = "" if part.dash is None else f' stroke-dasharray="{part.dash[0]:g} {part.dash[1]:g}"'
        return (
            f'<polyline points="{_points(part.points)}" fill="none" stroke="{part.colour}" '
            f'stroke-width="{part.width:g}" stroke-linejoin="round"{dash}/>'
        )
    if isinstance(part, Area):
        return (
            f'<polygon points="{_points(part.points)}" fill="{part.colour}" '
            f'fill-opacity="{part.opacity:g}"/>'
        )
    if isinstance(part, Dots):
        return _dots(part)
    if isinstance(part, Label):
        ends = "" if part.anchor == "start" else f' text-anchor="{part.anchor}"'
        own = "" if part.size == FONT else f" font-size:{part.size:g}px;"
        own += "" if part.colour == GREY else f" fill:{part.colour};"
        style = f' style="{own.strip()}"' if own else ""
        text = escape(part.text)
        return f'<text x="{part.x:.1f}" y="{part.y:.1f}"{ends}{style}>{text}</text>'
    return ""


def _dots(part: Dots) -> str:
    """One path for all dots of a colour: strokes of zero length with round caps."""
    found = []
    for colour in np.unique(part.colours, axis=0):
        mine = part.points[(part.colours == colour).all(axis=1)]
        path = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in mine)
        found.append(
            f'<path d="{path}" stroke="{named(colour)}" stroke-width="{2 * part.radius:g}" '
            f'stroke-linecap="round" stroke-opacity="{part.opacity:g}" fill="none"/>'
        )
    return "".join(found)


def _points(points: NDArray[np.floating]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
