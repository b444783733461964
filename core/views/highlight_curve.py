"""Reflectance against θh: the shape of the highlight, with the samples near it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..samples import MeasuredPoints
from .drawing import GRID, INK, Area, Dots, Drawing, Label, Line, Part, straight
from .subject import OTHER_DASH, Show, Subject, dark, round_up

LEFT, TOP, WIDTH, HEIGHT = 46.0, 16.0, 400.0, 200.0
STEPS = 241
TICKS = (0, 1, 5, 10, 20, 30, 45, 60, 75, 90)  # degrees
MAX_THETA_D_DISTANCE = np.radians(4.0)  # of the samples that are shown, from θd of the curve
QUARTER = np.pi / 2  # a right angle


def highlight_curve(
    subjects: Sequence[Subject], theta_d_degrees: float, show: Show | None = None
) -> Drawing:
    """ρ against θh from 0° to 90° at one θd and φd = 90°, θh on a square-root axis as in the MERL
    tables. The first subject is a solid line with its interval and samples, the others dashed."""
    show = show or Show()
    theta_d = np.radians(theta_d_degrees)
    theta_h = np.square(np.linspace(0.0, 1.0, STEPS)) * QUARTER
    angles = Angles(theta_h, np.full(STEPS, theta_d), np.full(STEPS, QUARTER))
    cos_i = np.cos(theta_h) * np.cos(theta_d)
    values = [show.values(s.evaluate(angles), cos_i) for s in subjects]
    top = round_up(max(float(v.max()) for v in values))
    x = _across(theta_h)
    parts = _frame(show, top)
    first = subjects[0]
    if first.interval is not None:
        ends = [show.values(v, cos_i) for v in first.interval(angles)]
        for c, colour in enumerate(show.colours):
            low, high = (np.stack([x, _height(show, end[:, c], top)], axis=1) for end in ends)
            parts.append(Area(np.concatenate([low, high[::-1]]), colour, 0.15))
    near = 0
    if first.points is not None:
        dots = _measured(first.points, theta_d, show, top)
        near = len(dots.points) // len(show.colours)
        parts.append(dots)
    for number, value in enumerate(values):
        for c, colour in enumerate(show.colours):
            path = np.stack([x, _height(show, value[:, c], top)], axis=1)
            parts.append(Line(path, colour, 1.6, OTHER_DASH if number else None))
    title = f"{show.unit} at θd = {theta_d_degrees:g}°"
    title += (
        f" · {near:,} samples within {np.degrees(MAX_THETA_D_DISTANCE):g}°"
        if first.points is not None
        else ""
    )
    parts.append(Label(LEFT, TOP - 5, title, colour=INK))
    if len(subjects) > 1:
        title = " · ".join(f"dashed: {s.label}" for s in subjects[1:])
        parts.append(Label(LEFT + WIDTH, TOP - 5, title, "end", INK))
    label = f"reflectance against theta h at theta d {theta_d_degrees:g} degrees"
    return Drawing(LEFT + WIDTH + 14, TOP + HEIGHT + 34, label, tuple(parts))


def _across(theta_h: NDArray[np.floating]) -> NDArray[np.float64]:
    """x of θh in radians."""
    return LEFT + WIDTH * np.sqrt(np.asarray(theta_h, np.float64) / QUARTER)


def _height(show: Show, value: NDArray[np.floating], top: float) -> NDArray[np.float64]:
    """y of reflectances; top: the value at the upper edge."""
    return TOP + HEIGHT * (1 - np.clip(show.length(value, top), 0.0, 1.0))


def _measured(points: MeasuredPoints, theta_d: float, show: Show, top: float) -> Dots:
    """Samples near the θd of the curve; those above the chart are drawn at its upper edge."""
    rows = np.flatnonzero(np.abs(points.angles.theta_d - theta_d) < MAX_THETA_D_DISTANCE)
    theta_h = points.angles.theta_h[rows]
    value = show.values(points.rho[rows], np.cos(theta_h) * np.cos(theta_d))
    x = _across(theta_h)
    shown = [np.stack([x, _height(show, v, top)], axis=1) for v in value.T]
    colours = [np.tile(dark(colour), (len(rows), 1)) for colour in show.colours]
    return Dots(np.concatenate(shown), np.concatenate(colours), 1.1, 0.45)


def _frame(show: Show, top: float) -> list[Part]:
    """Grid lines and labels of both axes."""
    right, bottom = LEFT + WIDTH, TOP + HEIGHT
    parts: list[Part] = []
    for fraction in (*show.rings(), 0.0):
        if show.scale == "log" and fraction == 0.0:
            continue
        y = bottom - HEIGHT * float(show.length(fraction, 1.0))
        parts.append(straight(LEFT, y, right, y))
        parts.append(Label(LEFT - 5, y + 3.5, f"{top * fraction:.3g}", "end"))
    for degrees in TICKS:
        x = float(_across(np.radians([degrees]))[0])
        parts.append(straight(x, TOP, x, bottom, GRID))
        parts.append(Label(x, bottom + 13, f"{degrees}°", "middle"))
    parts.append(straight(LEFT, bottom, right, bottom, "#9999aa"))
    parts.append(Label(LEFT, bottom + 28, f"θh, square-root axis · {show.scale_name} scale"))
    return parts
