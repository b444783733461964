"""[[light]]: where the light comes from, one of five ways, and how strong it is."""

from __future__ import annotations

from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..light.sun_time import parse_time
from .entries import LightEntry, SphereEntry, SunEntry, WhiteEntry
from .section import Section, shown

LARGEST_SIDE = 131_072.0  # pixels
LARGEST = 1e9  # scan units

WAYS = ("direction", "sphere", "sun", "position", "mounted")


def read_light(section: Section) -> LightEntry:
    """One [[light]] table. Raises InputError naming the key and the line."""
    name = section.text("name")
    given = [way for way in WAYS if section.get(way) is not None]
    if len(given) != 1:
        found = " and ".join(given) if given else "none of them"
        raise section.error(
            f"expected one of {', '.join(WAYS)}; found {found}", given[1] if given else "direction"
        )
    way = given[0]
    distant = way in ("direction", "sphere", "sun")
    angle = beam = None
    radius = 0.0
    if distant:
        angle = np.radians(section.number("angle", 0.0, 0.0, 90.0)) if "angle" in section else None
    else:
        radius = section.number("radius", 0.0, 0.0, LARGEST)
    if way == "mounted" and "beam" in section:
        beam = float(np.radians(section.number("beam", 45.0, 1.0, 180.0)))
    entry = LightEntry(
        name=name,
        direction=_direction(section) if way == "direction" else None,
        sphere=_sphere(section.table("sphere")) if way == "sphere" else None,
        sun=_sun(section.table("sun")) if way == "sun" else None,
        position=section.vector("position"),
        mounted=section.vector("mounted", "right, down, forward"),
        strength=_strength(section, "irradiance" if distant else "intensity", distant),
        white=_white(section) if distant else None,
        angle=angle,
        radius=radius,
        beam=beam,
        refine=section.flag("refine", False),
    )
    mirror = entry.sphere is not None and entry.sphere.reflectance is not None
    if sum((entry.white is not None, entry.strength is not None, mirror)) > 1:
        raise section.error(
            "the irradiance is given twice (irradiance, white, the sphere's reflectance): leave "
            "one in",
            "white" if entry.white is not None else "irradiance",
        )
    section.close()
    return entry


def _direction(section: Section) -> NDArray[np.float64]:
    direction = section.vector("direction")
    assert direction is not None  # asked for because it is there
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise section.error("the direction has no length", "direction")
    return direction / length


def _strength(section: Section, key: str, distant: bool) -> NDArray[np.float64] | None:
    other = "intensity" if distant else "irradiance"
    if other in section:
        kind = "distant" if distant else "near"
        raise section.error(f"a {kind} light has no {other}; expected {key}", other)
    if not distant and "white" in section:
        raise section.error("a white target gives the irradiance of a distant light only", "white")
    strength = section.vector(key, "red, green, blue")
    if strength is not None and not (strength > 0).all():
        raise section.error(f"found {shown(strength.tolist())}, expected positive numbers", key)
    return strength


def _sphere(section: Section) -> SphereEntry:
    photo, camera = section.file_path("photo"), section.text("camera")
    centre = section.numbers("center", 2)
    radius = section.number("radius", 0.0, 1.0, LARGEST_SIDE) if "radius" in section else None
    mask = section.optional_file_path("mask")
    surface = section.optional_text("surface") or "chrome"
    mirror = section.number("reflectance", 0.6, 0.01, 1.0) if "reflectance" in section else None
    section.close()
    if surface not in ("chrome", "glossy"):
        raise section.error(f"found {surface!r}, expected 'chrome' or 'glossy'", "surface")
    if mirror is not None and surface != "chrome":
        raise section.error("only a chrome sphere's reflectance gives irradiance", "reflectance")
    if (centre is None) != (radius is None) or (centre is not None and mask is not None):
        raise section.error(
            "expected center and radius of its outline in pixels, or a mask, or neither: then it "
            "is searched for",
            "center",
        )
    return SphereEntry(photo, camera, surface, mirror, centre, radius, mask)


def _sun(section: Section) -> SunEntry:
    def optional(name: str, low: float, high: float) -> float | None:
        return section.number(name, 0.0, low, high) if name in section else None

    time = section.get("time")
    if time is not None:
        if not isinstance(time, str | datetime):
            raise section.error(f"found {shown(time)}, expected a time with its zone", "time")
        try:
            time = parse_time(time)
        except InputError as error:
            raise section.error(error.said, "time") from error
    entry = SunEntry(
        latitude=optional("latitude", -90.0, 90.0),
        longitude=optional("longitude", -180.0, 360.0),
        altitude=optional("altitude", -500.0, 20_000.0),
        time=time,
        north=section.vector("north"),
        up=section.vector("up"),
    )
    section.close()
    if (entry.latitude is None) != (entry.longitude is None):
        raise section.error("latitude and longitude belong together")
    if (entry.north is None) != (entry.up is None):
        raise section.error("north and up belong together")
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
