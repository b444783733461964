"""Charts as SVG text: axes, lines, points, error bars, panels in rows and columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

import numpy as np

COLOURS = ("#c0392b", "#2471a3", "#2e8b57", "#8e6bbf", "#d68910", "#5d6d7e", "#17a2a2")
INK, FAINT = "#334", "#e3e5ea"
LEFT, RIGHT, TOP, BOTTOM = 52, 10, 26, 40


@dataclass
class Chart:
    """One pair of axes. x_log, y_log: whether an axis is logarithmic; x_range, y_range: limits;
    x_ticks: (value, label) to replace automatic ticks. Positions are in data coordinates, all other
    lengths in pixels."""

    title: str
    x_label: str
    y_label: str
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    x_log: bool = False
    y_log: bool = False
    x_ticks: Sequence[tuple[float, str]] | None = None
    width: int = 300
    height: int = 220
    parts: list[str] = field(default_factory=list)

    def x(self, value: float) -> float:
        """Return the x coordinate of a value, pixels."""
        t = _place(value, self.x_range, self.x_log)
        return LEFT + t * (self.width - LEFT - RIGHT)

    def y(self, value: float) -> float:
        """Return the y coordinate of a value, pixels."""
        t = _place(value, self.y_range, self.y_log)
        return self.height - BOTTOM - t * (self.height - TOP - BOTTOM)

    def line(
        self, xs: Sequence[float], ys: Sequence[float], colour: str, dash: str = "",
        marks: bool = True,
    ) -> None:  # fmt: skip
        """Draw a polyline, with a dot at each point if ``marks``."""
        path = " ".join(f"{self.x(a):.1f},{self.y(b):.1f}" for a, b in zip(xs, ys, strict=True))
        extra = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.8"{extra}/>'
        )
        if marks:
            for a, b in zip(xs, ys, strict=True):
                self.dot(a, b, colour, 2.6)

    def band(
        self, xs: Sequence[float], low: Sequence[float], high: Sequence[float], colour: str
    ) -> None:
        """Fill the area between two lines."""
        there = [f"{self.x(a):.1f},{self.y(b):.1f}" for a, b in zip(xs, low, strict=True)]
        back = [f"{self.x(a):.1f},{self.y(b):.1f}" for a, b in zip(xs, high, strict=True)]
        points = " ".join(there + back[::-1])
        self.parts.append(f'<polygon points="{points}" fill="{colour}" fill-opacity="0.13"/>')

    def dot(self, x: float, y: float, colour: str, radius: float = 2.6) -> None:
        """Draw a point."""
        self.parts.append(
            f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="{radius}" fill="{colour}" '
            'fill-opacity="0.8"/>'
        )

    def ring(self, x: float, y: float, colour: str) -> None:
        """Draw a ring around a point."""
        self.parts.append(
            f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="5" fill="none" '
            f'stroke="{colour}" stroke-width="1.6"/>'
        )

    def whisker(self, x: float, low: float, high: float, colour: str) -> None:
        """Draw a vertical error bar from low to high."""
        c, upper, lower = self.x(x), self.y(high), self.y(low)
        self.parts.append(
            f'<path d="M{c:.1f} {upper:.1f}V{lower:.1f}M{c - 2:.1f} {upper:.1f}h4'
            f'M{c - 2:.1f} {lower:.1f}h4" stroke="{colour}" stroke-width="1.2" fill="none"/>'
        )

    def shade(self, low: float, high: float) -> None:
        """Shade the area between two values of x."""
        a, b = self.x(low), self.x(high)
        self.parts.append(
            f'<rect x="{a:.1f}" y="{TOP}" width="{b - a:.1f}" '
            f'height="{self.height - TOP - BOTTOM}" fill="#f4f5f8"/>'
        )

    def level(self, y: float, colour: str = INK, dash: str = "4 3") -> None:
        """Draw a horizontal line over the full width."""
        self.parts.append(
            f'<path d="M{LEFT} {self.y(y):.1f}H{self.width - RIGHT}" stroke="{colour}" '
            f'stroke-dasharray="{dash}" fill="none"/>'
        )

    def text(self, x: float, y: float, words: str, anchor: str = "start") -> None:
        """Write text at a point."""
        self.parts.append(
            f'<text x="{self.x(x):.1f}" y="{self.y(y):.1f}" text-anchor="{anchor}">'
            f"{escape(words)}</text>"
        )

    def drawing(self) -> str:
        """Return the chart as an SVG group."""
        bottom, right = self.height - BOTTOM, self.width - RIGHT
        out = [f'<text x="{LEFT}" y="15" class="t">{escape(self.title)}</text>']
        for value, label in _ticks(self.y_range, self.y_log):
            y = self.y(value)
            out.append(f'<path d="M{LEFT} {y:.1f}H{right}" stroke="{FAINT}" fill="none"/>')
            out.append(f'<text x="{LEFT - 5}" y="{y + 3.5:.1f}" text-anchor="end">{label}</text>')
        for value, label in self.x_ticks or _ticks(self.x_range, self.x_log):
            x = self.x(value)
            out.append(f'<path d="M{x:.1f} {bottom}v4" stroke="{INK}" fill="none"/>')
            out.append(
                f'<text x="{x:.1f}" y="{bottom + 15}" text-anchor="middle">{escape(label)}</text>'
            )
        out += self.parts
        out.append(f'<path d="M{LEFT} {TOP}V{bottom}H{right}" stroke="{INK}" fill="none"/>')
        out.append(
            f'<text x="{(LEFT + right) / 2:.1f}" y="{self.height - 6}" text-anchor="middle">'
            f"{escape(self.x_label)}</text>"
        )
        middle = (TOP + bottom) / 2
        out.append(
            f'<text x="12" y="{middle:.1f}" text-anchor="middle" '
            f'transform="rotate(-90 12 {middle:.1f})">{escape(self.y_label)}</text>'
        )
        return "".join(out)


def legend(entries: Sequence[tuple[str, str, str]]) -> str:
    """Return an SVG group of entries in a row: (label, colour, dash or "bar" for a rectangle)."""
    out, x = [], 8.0
    for label, colour, dash in entries:
        if dash == "bar":
            out.append(f'<rect x="{x:.0f}" y="5" width="12" height="10" fill="{colour}"/>')
            x += 17
        else:
            extra = f' stroke-dasharray="{dash}"' if dash else ""
            out.append(
                f'<path d="M{x:.0f} 10h24" stroke="{colour}" stroke-width="2" fill="none"{extra}/>'
            )
            x += 29
        out.append(f'<text x="{x:.0f}" y="14">{escape(label)}</text>')
        x += 6.1 * len(label) + 16
    return "".join(out)


def sheet(
    panels: Sequence[str], columns: int, size: tuple[int, int], head: str = "", title: str = ""
) -> str:
    """Return an SVG file with panels (SVG groups of one size) in rows under a legend, on white."""
    rows = -(-len(panels) // columns)
    above = 24 if head else 4
    width, height = columns * size[0], rows * size[1] + above
    body = [
        f'<g transform="translate({i % columns * size[0]} {i // columns * size[1] + above})">'
        f"{panel}</g>"
        for i, panel in enumerate(panels)
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" role="img" aria-label="{escape(title)}">'
        "<style>text{font:11px 'DejaVu Sans',Helvetica,Arial,sans-serif;fill:#334}"
        "text.t{font-weight:600}</style>"
        f'<rect width="{width}" height="{height}" fill="#fff"/>{head}{"".join(body)}</svg>\n'
    )


def _place(value: float, span: tuple[float, float], logarithmic: bool) -> float:
    low, high = span
    if logarithmic:
        value, low, high = (float(np.log10(max(v, 1e-300))) for v in (value, low, high))
    return float(np.clip((value - low) / (high - low), -0.02, 1.04))


def _ticks(span: tuple[float, float], logarithmic: bool) -> list[tuple[float, str]]:
    low, high = span
    if logarithmic:
        decades = np.log10(high / low)
        steps: Sequence[int] = (1,) if decades > 3 else (1, 3) if decades > 1.2 else (1, 2, 5)
        values = [
            m * 10.0**p
            for p in range(int(np.floor(np.log10(low))) - 1, int(np.ceil(np.log10(high))) + 1)
            for m in steps
        ]
        shown = [v for v in values if low * 0.999 <= v <= high * 1.001]
    else:
        raw = (high - low) / 4
        power = 10.0 ** np.floor(np.log10(raw))
        step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= raw * 0.999)
        shown = list(np.arange(np.ceil(low / step - 1e-9) * step, high + step * 1e-6, step))
    return [(v, f"{v + 0.0:.4g}" if abs(v) > 1e-12 else "0") for v in shown]
