"""A polar slice as in Fig. 9 of the paper: a half-circle with the normal upwards."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from patina.core.views.polar import slice_angles
from patina.core.views.subject import COLOURS, round_up

from .svg import FAINT

RADIUS, WIDTH = 138.0, 310.0
BASE = 168.0  # y of the surface, pixels from the top


def half_circle(
    title: str, curves: Sequence[tuple[NDArray[np.float64], str]], incidence: float, top: float
) -> str:
    """Return an SVG group of curves ((n, 3) ρ at the directions of slice_angles, dash).

    The radius is the cube root of ρ. The outer ring is ``top``, rounded up to 1, 2 or 5 times a
    power of ten, so that panels of one material can share it. Light comes from the left at
    ``incidence`` degrees.
    """
    theta, _ = slice_angles(np.radians(incidence))
    ring, centre = round_up(top), WIDTH / 2
    out = [f'<text x="8" y="13" class="t">{escape(title)}</text>']
    for part in (1.0, 0.1, 0.01):
        r = RADIUS * np.cbrt(part)
        out.append(
            f'<path d="M{centre - r:.1f} {BASE}A{r:.1f} {r:.1f} 0 0 1 {centre + r:.1f} {BASE}" '
            f'fill="none" stroke="{FAINT}"/><text x="{centre + r:.1f}" y="{BASE + 13}" '
            f'text-anchor="middle">{ring * part:.3g}</text>'
        )
    out.append(
        f'<path d="M{centre - RADIUS} {BASE}H{centre + RADIUS}M{centre} {BASE}V{BASE - RADIUS}" '
        f'stroke="{FAINT}" fill="none"/>'
    )
    i = np.radians(incidence)
    x, y = centre - RADIUS * np.sin(i), BASE - RADIUS * np.cos(i)
    out.append(
        f'<path d="M{x:.1f} {y:.1f}L{centre} {BASE}" stroke="#e0a000" stroke-width="1.5" '
        'stroke-dasharray="2 3"/>'
    )
    for values, dash in curves:
        radius = RADIUS * np.cbrt(np.maximum(values, 0) / ring)
        extra = f' stroke-dasharray="{dash}"' if dash else ' stroke-opacity="0.55"'
        for channel, colour in enumerate(COLOURS):
            xs = centre + radius[:, channel] * np.sin(theta)
            ys = BASE - radius[:, channel] * np.cos(theta)
            keep = _simplified(xs, ys)
            path = " ".join(f"{xs[k]:.1f},{ys[k]:.1f}" for k in keep)
            out.append(
                f'<polyline points="{path}" fill="none" stroke="{colour}" '
                f'stroke-width="{1.3 if dash else 2.2}" stroke-linejoin="round"{extra}/>'
            )
    return "".join(out)


def _simplified(xs: NDArray, ys: NDArray) -> list[int]:
    """Return indices of points at least 1.5 pixels apart: the file is ten times smaller."""
    keep = [0]
    for k in range(1, len(xs) - 1):
        if np.hypot(xs[k] - xs[keep[-1]], ys[k] - ys[keep[-1]]) >= 1.5:
            keep.append(k)
    return [*keep, len(xs) - 1]
