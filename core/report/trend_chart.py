"""Chart of the residual along one coordinate, as SVG."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from itertools import pairwise

import numpy as np

from ..diagnose.selection.residual_trends import Trend
from .svg_element import svg_element

WIDTH, HEIGHT = 280, 150
LEFT, RIGHT, TOP, BOTTOM = 40, 8, 20, 24
MIN_STRIP = 2.0  # pixels: values closer than this are shown together
MAX_TICKS = 5  # steps between marks of the horizontal axis
COLOURS = ("#b4443c", "#2f6fb0")  # before, after


def trend_chart(name: str, unit: str, before: Trend, after: Trend | None, most: float) -> str:
    """An SVG element, empty where there is no bin. name, unit: of the coordinate. after: None where
    nothing was corrected. most: limit of the vertical axis, relative to the prediction. Bars are
    two standard errors."""
    drawn = [before] if after is None else [before, after]
    at = np.concatenate([t.at for t in drawn] or [np.zeros(1)])
    if not len(at):
        return ""
    low, high = float(at.min()), float(at.max())
    span = max(high - low, 1e-9)

    def x(value: float) -> float:
        return LEFT + (value - low) / span * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        part = np.clip(value / most, -1, 1)
        return float(TOP + (1 - part) / 2 * (HEIGHT - TOP - BOTTOM))

    lines = [
        f"<line x1='{LEFT}' x2='{WIDTH - RIGHT}' y1='{y(0):.1f}' y2='{y(0):.1f}' stroke='#999'/>"
    ]
    for trend, colour in zip(drawn, COLOURS, strict=False):
        points = " ".join(
            f"{x(a):.1f},{y(m):.1f}" for a, m in zip(trend.at, trend.mean, strict=True)
        )
        lines.append(
            f"<polyline points='{points}' fill='none' stroke='{colour}' stroke-width='1.6'/>"
        )
        for a, m, e in zip(trend.at, trend.mean, trend.error, strict=True):
            lines.append(
                f"<line x1='{x(a):.1f}' x2='{x(a):.1f}' y1='{y(m - 2 * e):.1f}' "
                f"y2='{y(m + 2 * e):.1f}' stroke='{colour}' stroke-opacity='.45'/>"
            )
    levels = "".join(
        f"<text x='{LEFT - 4}' y='{y(share * most) + 4:.0f}' text-anchor='end'>"
        f"{100 * share * most:+.3g} %</text>"
        for share in (1.0, 0.5, 0.0, -0.5, -1.0)
    )
    ticks = "".join(
        f"<line x1='{x(t):.1f}' x2='{x(t):.1f}' y1='{HEIGHT - BOTTOM}' y2='{HEIGHT - BOTTOM + 3}' "
        f"stroke='#999'/><text x='{x(t):.1f}' y='{HEIGHT - 6}' text-anchor='middle'>{t:g}</text>"
        for t in _round_values(low, high)
    )
    label = escape(name + (f" ({unit})" if unit else ""))
    return svg_element(
        WIDTH, HEIGHT, label,
        f"<text x='{LEFT}' y='12' font-weight='bold'>{label}</text>"
        f"{levels}{ticks}{''.join(lines)}{_values(drawn, unit, x)}",
    )  # fmt: skip


def _values(drawn: Sequence[Trend], unit: str, x: Callable[[float], float]) -> str:
    """SVG: strips that show their values under the pointer, one for each place with a bin. x: from
    the coordinate to pixels."""
    places: dict[float, list[str]] = {}
    for trend, kind in zip(drawn, ("before", "after") if len(drawn) > 1 else ("",), strict=True):
        for a, m, e in zip(trend.at, trend.mean, trend.error, strict=True):
            value = f"{round(100 * m, 1) + 0.0:+.1f} ± {200 * e:.1f} %"
            near = [p for p in places if abs(x(p) - x(a)) < MIN_STRIP]
            place = near[0] if near else float(a)
            places.setdefault(place, []).append(f"{kind} {value}".strip())
    if not places:
        return ""
    at, of = sorted(places), escape(f" {unit}" if unit else "")
    edges = [LEFT, *((x(a) + x(b)) / 2 for a, b in pairwise(at)), WIDTH - RIGHT]
    return "".join(
        f"<rect class='strip' x='{left:.1f}' y='{TOP}' width='{max(right - left, 1):.1f}' "
        f"height='{HEIGHT - TOP - BOTTOM}'><title>{_number(a)}{of}: "
        f"{'; '.join(places[a])}</title></rect>"
        for a, left, right in zip(at, edges[:-1], edges[1:], strict=True)
    )


def _number(value: float) -> str:
    """Three digits or more, without an exponent."""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _round_values(low: float, high: float) -> list[float]:
    """Round values within the range, MAX_TICKS + 1 at most."""
    span = max(high - low, 1e-9)
    power = 10.0 ** np.floor(np.log10(span / MAX_TICKS))
    step = next(power * m for m in (1, 2, 5, 10) if span / (power * m) <= MAX_TICKS)
    first = int(np.ceil(low / step))
    return [round(step * i, 12) for i in range(first, int(np.floor(high / step)) + 1)]
