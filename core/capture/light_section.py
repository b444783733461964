"""Read a [[light]] table: direction or position, in one of five ways, and strength."""

from __future__ import annotations

from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..light.sun_time import parse_time
from .entries import LightEntry, SphereEntry, SunEntry, WhiteEntry
from .section import Section, shown

MAX_RADIUS_PIXELS = 131_072.0
MAX_RADIUS = 1e9  # scan units

IRRADIANCES, INTENSITIES = (1e-9, 1e9), (1e-15, 1e21)
"""Limits in the photos' unit of radiance. Pixel values up to 1 and exposures from 1/8000 s to an
hour stay within, and intensities at distances from a thousandth to a million scan units too.
Beyond, all pixels of a photo would be black or white."""

LOCATION_KEYS = ("direction", "sphere", "sun", "position", "mounted")


def read_light(section: Section) -> LightEntry:
    """One [[light]] table. Raises InputError naming the key and the line."""
    name = section.text("name")
    given = [key for key in LOCATION_KEYS if section.get(key) is not None]
    if len(given) != 1:
        found = " and ".join(given) if given else "none of them"
        raise section.error(
            f"found {found}; expected exactly one of {', '.join(LOCATION_KEYS)}",
            given[1] if given else "direction",
        )
    location = given[0]
    distant = location in ("direction", "sphere", "sun")
    angle = beam = None
    radius = 0.0
    if distant:
        angle = np.radians(section.number("angle", 0.0, 0.0, 90.0)) if "angle" in section else None
    else:
        radius = section.number("radius", 0.0, 0.0, MAX_RADIUS)
    if location == "mounted" and "beam" in section:
        beam = float(np.radians(section.number("beam", 45.0, 1.0, 180.0)))
    entry = LightEntry(
        name=name,
        direction=_direction(section) if location == "direction" else None,
        sphere=_sphere(section.table("sphere")) if location == "sphere" else None,
        sun=_sun(section.table("sun")) if location == "sun" else None,
        position=section.vector("position"),
        mounted=section.vector("mounted", "right, down, forward"),
        strength=_strength(section, "irradiance" if distant else "intensity", distant),
        white=_white(section) if distant else None,
        angle=angle,
        radius=radius,
        beam=beam,
        refine=section.flag("refine", False),
        guess=section.flag("guess", False),
        standard_error=_standard_error(section, distant),
        relative_strength=section.optional_number("relative_strength", 1e-6, 1e6),
    )
    if entry.relative_strength is not None and entry.strength_given:
        raise section.error(
            "the strength is given; a relative strength is only for lights of unknown strength: "
            "remove one of the two",
            "relative_strength",
        )
    if entry.sphere is not None or entry.sun is not None:
        for key in ("guess", "standard_error"):
            if key in section:
                raise section.error(
                    f"the {location} gives the direction; expected no {key}: remove it", key
                )
    if entry.guess and entry.standard_error is not None:
        raise section.error("a guess has no standard error; remove one of the two", "guess")
    mirror = entry.sphere is not None and entry.sphere.reflectance is not None
    if sum((entry.white is not None, entry.strength is not None, mirror)) > 1:
        raise section.error(
            "the irradiance is given more than once; expected only one of irradiance, white and "
            "the sphere's reflectance: remove the others",
            "white" if entry.white is not None else "irradiance",
        )
    section.close()
    return entry


def _direction(section: Section) -> NDArray[np.float64]:
    direction = section.vector("direction")
    assert direction is not None  # only called where the key is present
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise section.error("found a vector of length 0; expected a direction", "direction")
    return direction / length


def _standard_error(section: Section, distant: bool) -> float | None:
    """Radians for a direction, scan units for a position or offset."""
    error = section.optional_number("standard_error", 0.0, 180.0 if distant else MAX_RADIUS)
    return float(np.radians(error)) if distant and error is not None else error


def _strength(section: Section, key: str, distant: bool) -> NDArray[np.float64] | None:
    other = "intensity" if distant else "irradiance"
    if other in section:
        kind = "distant" if distant else "near"
        raise section.error(f"a {kind} light has no {other}; expected {key}", other)
    if not distant and "white" in section:
        raise section.error(
            "a white target gives only the irradiance of a distant light; for a near light give "
            "intensity",
            "white",
        )
    strength = section.vector(key, "red, green, blue")
    low, high = IRRADIANCES if distant else INTENSITIES
    if strength is not None and not ((strength >= low) & (strength <= high)).all():
        raise section.error(
            f"found {shown(strength.tolist())}; expected numbers from {low:g} to {high:g}", key
        )
    return strength


def _sphere(section: Section) -> SphereEntry:
    photo, camera = section.file_path("photo"), section.text("camera")
    centre = section.numbers("center", 2)
    radius = section.optional_number("radius", 1.0, MAX_RADIUS_PIXELS)
    mask = section.optional_file_path("mask")
    surface = section.optional_text("surface") or "chrome"
    mirror = section.optional_number("reflectance", 0.01, 1.0)
    section.close()
    if surface not in ("chrome", "glossy"):
        raise section.error(f"found {surface!r}; expected 'chrome' or 'glossy'", "surface")
    if mirror is not None and surface != "chrome":
        raise section.error(
            "only the reflectance of a chrome sphere gives the irradiance; remove reflectance, or "
            "set surface = 'chrome'",
            "reflectance",
        )
    if (centre is None) != (radius is None) or (centre is not None and mask is not None):
        raise section.error(
            "expected center and radius of the sphere's outline in pixels, or a mask, or neither "
            "(then Patina searches for the sphere)",
            "center",
        )
    return SphereEntry(photo, camera, surface, mirror, centre, radius, mask)


def _sun(section: Section) -> SunEntry:
    time = section.get("time")
    if time is not None:
        if not isinstance(time, str | datetime):
            raise section.error(f"found {shown(time)}; expected a time with its time zone", "time")
        try:
            time = parse_time(time)
        except InputError as error:
            raise section.error(error.detail, "time") from error
    entry = SunEntry(
        latitude=section.optional_number("latitude", -90.0, 90.0),
        longitude=section.optional_number("longitude", -180.0, 360.0),
        altitude=section.optional_number("altitude", -500.0, 20_000.0),
        time=time,
        north=section.vector("north"),
        up=section.vector("up"),
    )
    section.close()
    if (entry.latitude is None) != (entry.longitude is None):
        raise section.error("only one of latitude and longitude is given; expected both or none")
    if (entry.north is None) != (entry.up is None):
        raise section.error("only one of north and up is given; expected both or none")
    return entry


def _white(section: Section) -> WhiteEntry | None:
    if "white" not in section:
        return None
    table = section.table("white")
    table.get("reflectance", required=True)
    entry = WhiteEntry(
        photo=table.file_path("photo"),
        mask=table.file_path("mask"),
        reflectance=table.number("reflectance", 0.9, 0.01, 1.2),
        normal=table.vector("normal"),
        exposure=table.number("exposure", 1.0, 1e-12, 1e12) if "exposure" in table else None,
    )
    table.close()
    return entry
