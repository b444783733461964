"""The θh × θd slice of a BRDF as an image (Burley 2012, "Physically-based shading at Disney",
"image slices"), θh on a square-root axis, with the samples drawn over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines
from ..samples import MeasuredPoints
from . import display
from .drawing import INK, Dots, Drawing, Label, Part, Picture, box, named
from .subject import Show, Subject, round_up

LEFT, TOP, WIDTH, HEIGHT = 40.0, 18.0, 400.0, 200.0
CELLS = (200, 100)  # pixels along θh and θd
QUARTER = np.pi / 2  # a right angle
TICKS_H, TICKS_D = (0, 1, 5, 10, 20, 45, 90), (0, 15, 30, 45, 60, 75, 90)
POINT_FULL = 0.30  # relative difference between sample and fit that is shown in full colour
MAX_INTERVAL_STOPS = 2.0  # log2 of the half width of an interval that is shown in the last colour
# light to dark in even steps of lightness, for one-sided quantities
SEQUENCE = np.array([[252, 251, 240], [250, 205, 120], [226, 120, 75], [160, 45, 95], [55, 15, 80]])
WHITE_TO_MEDIAN = 20.0  # white over the median reflectance: highlights clip, the rest is visible
POINT = np.array([20, 22, 30], np.uint8)  # sRGB of samples on an interval slice


@dataclass(frozen=True)
class _Field:
    """A slice as an image: pixels (θd, θh, 3) uint8; key: (text, colour) of each legend entry."""

    pixels: NDArray[np.uint8]
    title: str
    key: tuple[tuple[str, NDArray[np.uint8]], ...]


def reflectance_slice(subject: Subject, phi_d_degrees: float, show: Show | None = None) -> Drawing:
    """The BRDF itself. Samples are blue where darker and red where brighter than the fit."""
    show = show or Show()
    angles, seen = _cells(phi_d_degrees)
    rho = np.maximum(np.asarray(subject.evaluate(angles), np.float64), 0)
    value = show.values(rho, np.maximum(cosines(*angles)[0], 0))
    top = round_up(WHITE_TO_MEDIAN * float(np.median(value[seen]))) if seen.any() else 1.0
    shown = np.clip(show.length(value, top), 0, 1)
    pixels = (np.broadcast_to(shown, (len(shown), 3)) * 255 + 0.5).astype(np.uint8)
    title = f"{show.unit}, {show.scale_name} up to {top:.3g} · φd = {phi_d_degrees:g}°"
    key: tuple[tuple[str, NDArray[np.uint8]], ...] = ()
    if subject.points is not None:
        key = (
            ("sample darker than the fit", display.TOO_DARK.astype(np.uint8)),
            ("equal", display.RIGHT.astype(np.uint8)),
            (f"brighter (full at {100 * POINT_FULL:.0f} %)", display.TOO_BRIGHT.astype(np.uint8)),
        )
    return _drawing(_field(pixels, seen, title, key), _against(subject))


def interval_slice(subject: Subject, phi_d_degrees: float, show: Show | None = None) -> Drawing:
    """Half width of the 90 % interval of the BRDF, mean of the channels shown. Raises ValueError
    for a subject without an interval."""
    if subject.interval is None:
        raise ValueError("expected a fit with an interval")
    show = show or Show()
    angles, seen = _cells(phi_d_degrees)
    low, high = (np.maximum(show.select_channels(x), 1e-9) for x in subject.interval(angles))
    stops = 0.5 * np.log2(high / low).mean(axis=1)
    pixels = _sequential(stops / MAX_INTERVAL_STOPS)
    title = f"90 % interval of ρ · φd = {phi_d_degrees:g}°"
    marks = (("± 0 %", 1.0), ("± 20 %", 1.2), ("× or / 1.5", 1.5), ("× or / 2", 2.0),
             (f"× or / {2**MAX_INTERVAL_STOPS:g}", 2**MAX_INTERVAL_STOPS))  # fmt: skip
    key = tuple((text, _sequential(np.log2([f]) / MAX_INTERVAL_STOPS)[0]) for text, f in marks)
    points = subject.points
    dots = None if points is None else _dots(points, np.tile(POINT, (len(points), 1)))
    return _drawing(_field(pixels, seen, title, key), dots)


def ratio_slice(
    subject: Subject, other: Subject, phi_d_degrees: float, show: Show | None = None
) -> Drawing:
    """Ratio of another BRDF to this one, mean of the channels shown."""
    show = show or Show()
    angles, seen = _cells(phi_d_degrees)
    mine, its = (
        np.maximum(show.select_channels(s.evaluate(angles)), 1e-6) for s in (subject, other)
    )
    stops = np.log2(its / mine).mean(axis=1)[:, None]
    pixels = display.difference_picture(stops[None], np.zeros_like(stops)[None], 1.0)[0]
    title = f"{other.label} ÷ {subject.label} · φd = {phi_d_degrees:g}°"
    key = (
        ("half as bright, or less", display.TOO_DARK.astype(np.uint8)),
        ("the same", display.RIGHT.astype(np.uint8)),
        ("twice as bright, or more", display.TOO_BRIGHT.astype(np.uint8)),
    )
    return _drawing(_field(pixels, seen, title, key), None)


def _cells(phi_d_degrees: float) -> tuple[Angles, NDArray[np.bool_]]:
    """(angles (d · h,), True where light and view are above the horizon). θd increases upwards, so
    the last row has the smallest."""
    across, along = CELLS
    theta_h = np.square((np.arange(across) + 0.5) / across) * QUARTER
    theta_d = (1 - (np.arange(along) + 0.5) / along) * QUARTER
    h, d = (g.ravel() for g in np.meshgrid(theta_h, theta_d))
    angles = Angles(h, d, np.full_like(h, np.radians(phi_d_degrees)))
    cos_i, cos_o = cosines(*angles)
    return angles, (cos_i > 0) & (cos_o > 0)


def _field(
    pixels: NDArray[np.uint8],
    seen: NDArray[np.bool_],
    title: str,
    key: tuple[tuple[str, NDArray[np.uint8]], ...],
) -> _Field:
    shown = pixels.copy()
    shown[~seen] = display.UNKNOWN
    across, along = CELLS
    return _Field(shown.reshape(along, across, 3), title, key)


def _against(subject: Subject) -> Dots | None:
    """The samples, coloured by their relative difference from the fit at their own angles."""
    points = subject.points
    if points is None or not len(points):
        return None
    level = np.maximum(np.asarray(subject.evaluate(points.angles), np.float64).mean(axis=1), 1e-9)
    ratio = (points.rho.mean(axis=1) / level)[None, :, None]
    return _dots(points, display.difference_picture(ratio, np.ones_like(ratio), POINT_FULL)[0])


def _dots(points: MeasuredPoints, colours: NDArray[np.uint8]) -> Dots:
    """Samples (n) as dots of the given colours (n, 3)."""
    x = LEFT + WIDTH * np.sqrt(points.angles.theta_h / QUARTER)
    y = TOP + HEIGHT * (1 - points.angles.theta_d / QUARTER)
    return Dots(np.stack([x, y], axis=1).astype(np.float64), colours, 0.7, 0.75)


def _drawing(field: _Field, dots: Dots | None) -> Drawing:
    """The image with axes, samples and legend."""
    bottom = TOP + HEIGHT
    parts: list[Part] = [Picture(LEFT, TOP, WIDTH, HEIGHT, field.pixels)]
    if dots is not None:
        parts.append(dots)
    for degrees in TICKS_H:
        x = LEFT + WIDTH * np.sqrt(degrees / 90)
        parts.append(Label(x, bottom + 13, f"{degrees}°", "middle"))
    for degrees in TICKS_D:
        y = bottom - HEIGHT * degrees / 90
        parts.append(Label(LEFT - 5, y + 3.5, f"{degrees}°", "end"))
    parts.append(Label(LEFT, TOP - 6, field.title, colour=INK))
    parts.append(Label(LEFT + WIDTH, bottom + 28, "across: θh, square-root axis · up: θd", "end"))
    x = LEFT
    for text, colour in field.key:
        parts.append(box(x, bottom + 38, x + 10, bottom + 48, named(colour)))
        parts.append(Label(x + 14, bottom + 47, text))
        x += 14 + 5.6 * len(text) + 14
    height = bottom + (56 if field.key else 36)
    return Drawing(LEFT + WIDTH + 14, height, field.title, tuple(parts))


def _sequential(part: NDArray[np.floating] | list[float]) -> NDArray[np.uint8]:
    """(n,) values 0 … 1 → (n, 3) colours of SEQUENCE."""
    at = np.clip(np.asarray(part, np.float64), 0, 1) * (len(SEQUENCE) - 1)
    shown = [np.interp(at, np.arange(len(SEQUENCE)), SEQUENCE[:, c]) for c in range(3)]
    return (np.stack(shown, axis=-1) + 0.5).astype(np.uint8)
