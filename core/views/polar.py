"""Polar slices of a BRDF in the plane of incidence (Ono et al. 2019, Fig. 9)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines, half_difference
from ..samples import MeasuredPoints
from .drawing import GRID, INK, Area, Dots, Drawing, Label, Line, Part, straight
from .subject import OTHER_DASH, Show, Subject, dark, round_up

WIDTH, RADIUS, CENTRE_Y = 340, 150, 172
STEP = np.radians(0.5)
LAMP = "#e0a000"
# largest distance of the samples that are shown: from the incidence, and from the plane
NEAR_INCIDENCE, NEAR_PLANE = np.radians(2.5), np.radians(4.0)


def slice_angles(incidence: float) -> tuple[NDArray[np.float64], Angles]:
    """(signed θo, angles) in the plane of incidence, light from the left at ``incidence``; all in
    radians."""
    theta_o = np.arange(-np.radians(89), np.radians(89) + STEP / 2, STEP)
    light = np.array([-np.sin(incidence), 0.0, np.cos(incidence)])
    view = np.stack([np.sin(theta_o), np.zeros_like(theta_o), np.cos(theta_o)], axis=1)
    normal = np.broadcast_to(np.array([0.0, 0.0, 1.0]), view.shape)
    angles = half_difference(normal, np.broadcast_to(light, view.shape), view)
    # φd = 0 in this plane; at θh = 0 the azimuth is undefined, and a basis may depend on it
    return theta_o, angles._replace(phi_d=np.zeros_like(angles.phi_d))


def in_slice(
    points: MeasuredPoints, incidence: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """(rows, signed θo) of the samples near a slice. By reciprocity light and view may be swapped,
    so a sample can appear twice."""
    cos_i, cos_o = (np.clip(c, 0.0, 1.0) for c in cosines(*points.angles))
    cos_between = np.cos(2 * points.angles.theta_d.astype(np.float64))
    rows, places = [], []
    for cos_light, cos_view in ((cos_i, cos_o), (cos_o, cos_i)):
        sines = np.sqrt((1 - cos_light**2) * (1 - cos_view**2))
        cos_azimuth = np.clip((cos_between - cos_light * cos_view) / np.maximum(sines, 1e-9), -1, 1)
        theta_view = np.arccos(cos_view)
        off = np.arcsin(np.clip(np.sin(theta_view) * np.sqrt(1 - cos_azimuth**2), 0, 1))
        near = (np.abs(np.arccos(cos_light) - incidence) < NEAR_INCIDENCE) & (off < NEAR_PLANE)
        found = np.flatnonzero(near)
        rows.append(found)
        places.append(np.where(cos_azimuth > 0, -theta_view, theta_view)[found])
    return np.concatenate(rows), np.concatenate(places)


def polar(
    subjects: Sequence[Subject], incidence_degrees: float, show: Show | None = None
) -> Drawing:
    """A half-circle chart: the first subject as a solid line with its interval and samples, the
    others dashed. By default the radius is the cube root of ρ, so that the specular lobe and the
    diffuse part are both visible."""
    show = show or Show()
    incidence = np.radians(incidence_degrees)
    theta_o, angles = slice_angles(incidence)
    cos_i = np.cos(incidence)
    values = [show.values(s.evaluate(angles), cos_i) for s in subjects]
    ring = round_up(max(float(v.max()) for v in values))
    parts = _rings(show, ring)
    first = subjects[0]
    if first.interval is not None:
        low, high = (show.values(x, cos_i) for x in first.interval(angles))
        parts += _shaded(show, low, high, theta_o, ring)
    if first.points is not None:
        parts.append(_measured(first.points, incidence, show, ring))
    for number, value in enumerate(values):
        radius = RADIUS * show.length(value, ring)
        for channel, colour in enumerate(show.colours):
            path = _points(radius[:, channel], theta_o)
            parts.append(Line(path, colour, 1.6, OTHER_DASH if number else None))
    x, y = WIDTH / 2 - RADIUS * np.sin(incidence), CENTRE_Y - RADIUS * np.cos(incidence)
    parts.append(Line(np.array([[x, y], [WIDTH / 2, CENTRE_Y]]), LAMP, 1.6, (5.0, 3.0)))
    text = f"light at {incidence_degrees:g}° · radius: {show.scale_name} of {show.unit}"
    parts.append(Label(4, CENTRE_Y + 24, text))
    if len(subjects) > 1:
        text = " · ".join(f"dashed: {s.label}" for s in subjects[1:])
        parts.append(Label(WIDTH - 4, 10, text, "end", INK))
    label = f"polar slice at {incidence_degrees:g} degrees"
    return Drawing(WIDTH, CENTRE_Y + 30, label, tuple(parts))


def _rings(show: Show, ring: float) -> list[Part]:
    """Labelled half circles; ring: the reflectance at the rim."""
    centre = WIDTH / 2
    turn = np.linspace(-np.pi / 2, np.pi / 2, 91)
    parts: list[Part] = []
    for place, fraction in enumerate(show.rings()):
        r = RADIUS * float(show.length(fraction, 1.0))
        parts.append(Line(_points(np.full_like(turn, r), turn), GRID))
        if place % 2 == 0 or show.scale == "log":
            text = f"{ring * fraction:.3g}"
            parts.append(Label(centre + r - 2, CENTRE_Y + 12, text, "end"))
    parts.append(straight(centre - RADIUS, CENTRE_Y, centre + RADIUS, CENTRE_Y, "#9999aa"))
    return parts


def _measured(points: MeasuredPoints, incidence: float, show: Show, ring: float) -> Dots:
    """Samples near the slice; those beyond the chart are drawn on its rim."""
    rows, theta_o = in_slice(points, incidence)
    value = show.values(points.rho[rows], np.cos(incidence))
    radius = RADIUS * np.minimum(show.length(value, ring), 1.02)
    shown = [_points(radius[:, c], theta_o) for c in range(radius.shape[1])]
    colours = [np.tile(dark(colour), (len(rows), 1)) for colour in show.colours]
    return Dots(np.concatenate(shown), np.concatenate(colours), 1.1, 0.55)


def _points(radius: NDArray, theta_o: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.stack(
        [WIDTH / 2 + radius * np.sin(theta_o), CENTRE_Y - radius * np.cos(theta_o)], axis=1
    )


def _shaded(
    show: Show,
    low: NDArray[np.floating],
    high: NDArray[np.floating],
    theta_o: NDArray[np.floating],
    ring: float,
) -> list[Part]:
    """The interval between low and high, clipped to the chart."""
    inner, outer = (RADIUS * np.clip(show.length(x, ring), 0.0, 1.0) for x in (low, high))
    return [
        Area(
            np.concatenate([_points(inner[:, c], theta_o), _points(outer[::-1, c], theta_o[::-1])]),
            colour,
            0.15,
        )
        for c, colour in enumerate(show.colours)
    ]
