"""Polar slices of a BRDF in the plane of incidence, as SVG (the paper, Fig. 9)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference

COLOURS = ("#d62728", "#2a9d3a", "#1f5fd6")
WIDTH, RADIUS, CENTRE_Y = 340, 150, 172
STEP = np.radians(0.5)


@dataclass(frozen=True)
class Curve:
    """One BRDF to draw. evaluate(angles) -> ρ (n, 3); interval(angles) -> (low, high) (n, 3), to be
    shaded; dash: an SVG dash pattern."""

    label: str
    evaluate: Callable[[Angles], NDArray[np.floating]]
    interval: Callable[[Angles], tuple[NDArray[np.floating], NDArray[np.floating]]] | None = None
    dash: str = ""


def slice_angles(incidence: float) -> tuple[NDArray[np.float64], Angles]:
    """(θo signed, angles) in the plane of incidence, light from the left at ``incidence``."""
    theta_o = np.arange(-np.radians(89), np.radians(89) + STEP / 2, STEP)
    light = np.array([-np.sin(incidence), 0.0, np.cos(incidence)])
    view = np.stack([np.sin(theta_o), np.zeros_like(theta_o), np.cos(theta_o)], axis=1)
    normal = np.broadcast_to(np.array([0.0, 0.0, 1.0]), view.shape)
    angles = half_difference(normal, np.broadcast_to(light, view.shape), view)
    # the plane's own azimuth: where θh = 0 none is defined, and a basis may differ between them
    return theta_o, angles._replace(phi_d=np.zeros_like(angles.phi_d))


def polar_chart(curves: Sequence[Curve], incidence_degrees: float) -> str:
    """One half-circle chart; the radius is the cube root of ρ, so that lobe and body both show."""
    theta_o, angles = slice_angles(np.radians(incidence_degrees))
    values = [np.maximum(np.asarray(c.evaluate(angles), np.float64), 0) for c in curves]
    top = max(float(v.max()) for v in values)
    ring = round_up(top)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {CENTRE_Y + 26}" '
        f'role="img" aria-label="polar slice at {incidence_degrees:g} degrees">',
        "<style>text{font:10px system-ui,sans-serif;fill:#667}</style>",
    ]
    centre = WIDTH / 2
    for fraction in (1.0, 0.3, 0.1, 0.03, 0.01):
        r = RADIUS * np.cbrt(fraction)
        parts.append(
            f'<path d="M{centre - r:.1f} {CENTRE_Y} A{r:.1f} {r:.1f} 0 0 1 {centre + r:.1f} '
            f'{CENTRE_Y}" fill="none" stroke="#dde" />'
        )
        if fraction in (1.0, 0.1, 0.01):
            parts.append(
                f'<text x="{centre + r - 2:.1f}" y="{CENTRE_Y + 12}" text-anchor="end">'
                f"{ring * fraction:.3g}</text>"
            )
    parts.append(
        f'<line x1="{centre - RADIUS}" y1="{CENTRE_Y}" x2="{centre + RADIUS}" y2="{CENTRE_Y}" '
        'stroke="#99a"/>'
    )
    for curve in curves:
        if curve.interval is not None:
            parts += _shaded(curve.interval(angles), theta_o, ring)
    for curve, value in zip(curves, values, strict=True):
        radius = RADIUS * np.cbrt(value / ring)
        for channel in range(3):
            path = _points(radius[:, channel], theta_o)
            dash = f' stroke-dasharray="{curve.dash}"' if curve.dash else ""
            parts.append(
                f'<polyline points="{path}" fill="none" stroke="{COLOURS[channel]}" '
                f'stroke-width="1.6" stroke-linejoin="round"{dash}/>'
            )
    i = np.radians(incidence_degrees)
    x, y = centre - RADIUS * np.sin(i), CENTRE_Y - RADIUS * np.cos(i)
    parts.append(
        f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{centre:.1f}" y2="{CENTRE_Y}" stroke="#e0a000" '
        'stroke-width="1.6" stroke-dasharray="5 3"/>'
        f'<text x="4" y="{CENTRE_Y + 24}">light at {incidence_degrees:g}° · '
        "radius ∛ρ, rings in 1/sr</text></svg>"
    )
    return "".join(parts)


def _points(radius: NDArray, theta_o: NDArray[np.floating]) -> str:
    xs = WIDTH / 2 + radius * np.sin(theta_o)
    ys = CENTRE_Y - radius * np.cos(theta_o)
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(xs, ys, strict=True))


def _shaded(
    interval: tuple[NDArray[np.floating], NDArray[np.floating]],
    theta_o: NDArray[np.floating],
    ring: float,
) -> list[str]:
    """Between low and high, as far as the chart reaches."""
    low, high = (RADIUS * np.cbrt(np.clip(x / ring, 0.0, 1.0)) for x in interval)
    return [
        f'<polygon points="{_points(low[:, c], theta_o)} {_points(high[::-1, c], theta_o[::-1])}" '
        f'fill="{COLOURS[c]}" fill-opacity="0.15"/>'
        for c in range(3)
    ]


def round_up(x: float) -> float:
    """The next of 1, 2, 5 × 10ⁿ."""
    power = 10.0 ** np.floor(np.log10(max(x, 1e-9)))
    return next(m * power for m in (1, 2, 5, 10) if m * power >= x * (1 - 1e-9))
