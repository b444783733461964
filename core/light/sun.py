"""Compute the position of the sun and its direction in the scan's frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]

FIRST_YEAR, LAST_YEAR = 1800, 2149  # range of the polynomials of delta_t
MAX_ALTITUDE = 9000.0  # metres; a larger value is usually in feet or millimetres
MIN_NORTH_SINE = math.sin(math.radians(1.0))  # north must be at least 1° away from up

# Espenak & Meeus, "Five Millennium Canon of Solar Eclipses" (NASA TP-2006-214141), polynomial
# expressions for ΔT: (first year, year t is counted from, coefficients of t⁰, t¹, …), seconds
_DELTA_T: tuple[tuple[float, float, tuple[float, ...]], ...] = (
    (1800, 1800, (13.72, -0.332447, 0.0068612, 0.0041116, -0.00037436, 1.21272e-5, -1.699e-7,
                  8.75e-10)),
    (1860, 1860, (7.62, 0.5737, -0.251754, 0.01680668, -0.0004473624, 1 / 233174)),
    (1900, 1900, (-2.79, 1.494119, -0.0598939, 0.0061966, -0.000197)),
    (1920, 1920, (21.20, 0.84493, -0.076100, 0.0020936)),
    (1941, 1950, (29.07, 0.407, -1 / 233, 1 / 2547)),
    (1961, 1975, (45.45, 1.067, -1 / 260, -1 / 718)),
    (1986, 2000, (63.86, 0.3345, -0.060374, 0.0017275, 0.000651814, 2.373599e-5)),
    (2005, 2000, (62.92, 0.32217, 0.005589)),
)  # fmt: skip


@dataclass(frozen=True)
class SunPosition:
    """Position of the sun. azimuth: radians from true north through east, 0 … 2π. elevation:
    radians above the horizon, including refraction unless switched off. enu: (3,) unit, place →
    sun, (east, north, up)."""

    azimuth: float
    elevation: float
    enu: Array


def delta_t(year: float) -> float:
    """Terrestrial minus universal time, seconds, for a decimal year between 1800 and 2150.

    Espenak & Meeus 2006. It gives 74.5 s for 2025, where 69.2 s were measured. The sun moves by
    0.0002° in those 5 s, so a newer table is not needed here. Raises ValueError for another year.
    """
    if not FIRST_YEAR <= year < LAST_YEAR + 1:
        raise ValueError(f"ΔT is known from {FIRST_YEAR} to {LAST_YEAR}, not for {year}")
    if year >= 2050:
        return -20 + 32 * ((year - 1820) / 100) ** 2 - 0.5628 * (2150 - year)
    _, origin, coefficients = next(row for row in reversed(_DELTA_T) if year >= row[0])
    t = year - origin
    return sum(c * t**power for power, c in enumerate(coefficients))


def sun_direction(
    latitude: float,
    longitude: float,
    time: datetime,
    altitude: float = 0.0,
    refraction: bool = True,
    pressure: float | None = None,
    temperature: float | None = None,
) -> SunPosition:
    """Compute the sun's azimuth and elevation at a place and time.

    latitude, longitude: degrees, WGS 84, north and east positive. time: with time zone. altitude:
    metres. pressure (hPa), temperature (°C): of the air, for refraction; None for the standard
    atmosphere at that altitude. Raises InputError for a time without zone or outside 1800 … 2149,
    an impossible place, and a sun below the horizon.

    Reda & Andreas, "Solar position algorithm for solar radiation applications", Solar Energy
    76(5), 2004 (±0.0003° from year −2000 to 6000), from the library `sunposition`. UTC is used as
    UT1; the difference is less than 0.9 s or 0.004° of azimuth.
    """
    from sunposition import sunposition  # imported late: it imports numba if installed

    _check_place(latitude, longitude, altitude)
    moment = _utc(time)
    kelvin = 288.15 - 0.0065 * altitude  # ISO 2533 standard atmosphere, below 11 km
    if temperature is None:
        temperature = kelvin - 273.15
    if pressure is None:
        pressure = 1013.25 * (kelvin / 288.15) ** 5.25588
    year = moment.year + (moment.month - 0.5) / 12
    azimuth, zenith = (
        math.radians(float(angle))
        for angle in sunposition(
            np.datetime64(moment.replace(tzinfo=None), "us"),
            latitude,
            longitude,
            altitude,
            temperature=temperature,
            pressure=pressure if refraction else 0.0,
            delta_t=delta_t(year),
            jit=False,
        )[:2]
    )
    elevation = math.pi / 2 - zenith
    if elevation <= 0:
        raise InputError(
            f"the sun is {-math.degrees(elevation):.1f}° below the horizon at latitude "
            f"{latitude:g}, longitude {longitude:g} on {moment:%Y-%m-%d %H:%M:%S} UTC; expected it "
            "above: check the time zone and the longitude's sign (east is positive)"
        )
    flat = math.cos(elevation)
    enu = np.array([flat * math.sin(azimuth), flat * math.cos(azimuth), math.sin(elevation)])
    return SunPosition(azimuth, elevation, enu)


def sun_in_scan(enu: Array, north: Array, up: Array) -> Array:
    """Convert an (east, north, up) direction to a (3,) unit direction in the scan's frame.

    north, up: (3,) directions of north and up in the scan's frame, any length. up is used as given;
    of north only the part perpendicular to up. Raises InputError for vectors of length 0, and for
    north within 1° of up or down.
    """
    vertical = _unit(up, "up")
    pointing = _unit(north, "north")
    level = pointing - (pointing @ vertical) * vertical
    if np.linalg.norm(level) < MIN_NORTH_SINE:
        raise InputError(
            "north and up are parallel; expected north to be roughly horizontal",
            key="north",
        )
    level /= np.linalg.norm(level)
    east = np.cross(level, vertical)
    direction = np.asarray(enu, float) @ np.stack([east, level, vertical])
    return direction / np.linalg.norm(direction)


def _unit(vector: Array, key: str) -> Array:
    direction = np.asarray(vector, float)
    with np.errstate(over="ignore"):
        length = np.linalg.norm(direction) if direction.shape == (3,) else 0.0
    if not (np.isfinite(length) and length > 1e-12):
        raise InputError(f"is {vector}; expected three finite numbers, not all 0", key=key)
    return direction / length


def _check_place(latitude: float, longitude: float, altitude: float) -> None:
    for key, value, low, high, unit in (
        ("latitude", latitude, -90.0, 90.0, "degrees, north positive"),
        ("longitude", longitude, -180.0, 360.0, "degrees, east positive"),
        ("altitude", altitude, -500.0, MAX_ALTITUDE, "metres"),
    ):
        if not low <= value <= high:  # true for NaN too
            raise InputError(f"is {value}; expected {low:g} to {high:g} ({unit})", key=key)


def _utc(time: datetime) -> datetime:
    if time.tzinfo is None or time.utcoffset() is None:
        raise InputError(
            f"{time:%Y-%m-%d %H:%M:%S} has no time zone; expected one, as in "
            f"{time:%Y-%m-%dT%H:%M:%S}+02:00 (one hour changes the sun's azimuth by about 14°)",
            key="time",
        )
    if not FIRST_YEAR < time.year < LAST_YEAR:  # strict, so that UTC is in the range too
        raise InputError(
            f"the year {time.year} is not covered; expected {FIRST_YEAR + 1} to {LAST_YEAR - 1}",
            key="time",
        )
    return time.astimezone(UTC)
