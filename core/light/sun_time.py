"""Time and place of a photo: given by the user, or from the camera's EXIF."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from ..errors import InputError

MAX_CLOCK_ERROR = timedelta(minutes=2)  # between a camera's clock and its GPS
ZONE_STEP = timedelta(minutes=15)  # offsets of time zones from UTC are multiples of it
_STAMP = re.compile(r"(\d{4}):(\d\d):(\d\d)[ T](\d\d):(\d\d):(\d\d)")
_OFFSET = re.compile(r"([+-])(\d\d):?(\d\d)|Z")


@dataclass(frozen=True)
class PhotoTime:
    """The time of a photo. time: with time zone. source: names of the EXIF tags. notes: possible
    errors, sentences for the user."""

    time: datetime
    source: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PhotoPlace:
    """The place of a photo. latitude, longitude: degrees, north and east positive. altitude:
    metres, None if unknown."""

    latitude: float
    longitude: float
    altitude: float | None


def parse_time(value: str | datetime, key: str = "time") -> datetime:
    """Parse a time given by the user: a TOML date and time, or ISO 8601 text, with time zone.

    Raises InputError, naming ``key``, where it is not a time or has no zone.
    """
    if isinstance(value, str):
        try:
            time = datetime.fromisoformat(value.strip())
        except ValueError:
            raise InputError(
                f"{value[:40]!r} is not a date and time; expected one like "
                "2018-06-01T12:00:00+09:00",
                key=key,
            ) from None
    elif isinstance(value, datetime):
        time = value
    else:
        raise InputError(
            f"{str(value)[:40]!r} is not a date with a time of day; expected one like "
            "2018-06-01T12:00:00+09:00",
            key=key,
        )
    if time.tzinfo is None:
        raise InputError(
            f"{time.isoformat()} has no time zone; expected one, as in {time.isoformat()}+02:00, "
            "or Z for UTC (one hour changes the sun's azimuth by about 14°)",
            key=key,
        )
    return time


def photo_time(exif: Mapping[str, Any]) -> PhotoTime:
    """The time of a photo from its EXIF tags; keys may have the prefix "Exif:" or "GPS:".

    DateTimeOriginal with OffsetTimeOriginal, otherwise the GPS date and time stamps (UTC); never
    DateTime (ModifyDate), which editors change. Raises InputError where the time or its zone is
    unknown.
    """
    local = _stamp(_tag(exif, "DateTimeOriginal"))
    zone = _offset(_tag(exif, "OffsetTimeOriginal"))
    satellite = _satellite_time(exif)
    if local is not None and zone is not None:
        time = (local - zone).replace(tzinfo=UTC)
        notes: tuple[str, ...] = ()
        if satellite is not None and abs(satellite - time) > MAX_CLOCK_ERROR:
            notes = (
                f"the camera's clock gives {time:%Y-%m-%d %H:%M:%S} UTC, but its GPS gives "
                f"{satellite:%Y-%m-%d %H:%M:%S}. The clock is used.",
            )
        return PhotoTime(time, "DateTimeOriginal and OffsetTimeOriginal", notes)
    if satellite is not None:
        return PhotoTime(satellite, "GPSDateStamp and GPSTimeStamp", _clock_notes(local, satellite))
    if local is not None:
        raise InputError(
            f"the photo's time {local:%Y-%m-%d %H:%M:%S} has no time zone (no OffsetTimeOriginal "
            "and no GPS time in its EXIF); give the time with its zone, as in time = "
            f'"{local:%Y-%m-%dT%H:%M:%S}+02:00"',
            key="time",
        )
    raise InputError(
        "the photo has no time (no DateTimeOriginal in its EXIF); give the time with its zone, as "
        "in 2018-06-01T12:00:00+09:00",
        key="time",
    )


def photo_place(exif: Mapping[str, Any]) -> PhotoPlace:
    """The place of a photo from its GPS tags. Raises InputError where they are missing or
    invalid."""
    latitude = _degrees(exif, "Latitude", "N", "S", 90.0)
    longitude = _degrees(exif, "Longitude", "E", "W", 180.0)
    altitude = _number(_tag(exif, "Altitude"))
    if altitude is not None and str(_tag(exif, "AltitudeRef")) in ("1", "1.0", "b'\\x01'"):
        altitude = -altitude
    return PhotoPlace(latitude, longitude, altitude)


def _tag(exif: Mapping[str, Any], name: str) -> Any:
    for key in (name, f"Exif:{name}", f"GPS:{name}", f"GPS{name}"):
        if key in exif:
            return exif[key]
    return None


def _stamp(value: Any) -> datetime | None:
    """EXIF's "YYYY:MM:DD HH:MM:SS"; None for zeros or blanks, from cameras with no clock set."""
    found = _STAMP.match(value.strip()) if isinstance(value, str) else None
    if found is None:
        return None
    try:
        time = datetime(*(int(part) for part in found.groups()))  # type: ignore[arg-type]
    except ValueError:
        return None
    # leaves room for any time zone within the range of datetime
    return time if 2 <= time.year <= 9998 else None


def _offset(value: Any) -> timedelta | None:
    found = _OFFSET.fullmatch(value.strip().rstrip("\0")) if isinstance(value, str) else None
    if found is None:
        return None
    if found.group(1) is None:
        return timedelta(0)
    size = timedelta(hours=int(found.group(2)), minutes=int(found.group(3)))
    if size > timedelta(hours=14):
        return None
    return -size if found.group(1) == "-" else size


def _satellite_time(exif: Mapping[str, Any]) -> datetime | None:
    date, clock = _tag(exif, "DateStamp"), _tag(exif, "TimeStamp")
    if not isinstance(date, str) or clock is None:
        return None
    if isinstance(clock, str):
        clock = clock.strip().split(":")
    try:
        hours, minutes, seconds = (float(part) for part in clock)
        if not (0 <= hours < 24 and 0 <= minutes < 60 and 0 <= seconds < 61):  # true for NaN too
            return None
    except (TypeError, ValueError):
        return None
    day = _stamp(date.strip().replace("-", ":")[:10] + " 00:00:00")
    if day is None:
        return None
    return (day + timedelta(hours=hours, minutes=minutes, seconds=seconds)).replace(tzinfo=UTC)


def _clock_notes(local: datetime | None, satellite: datetime) -> tuple[str, ...]:
    """A note where the camera's clock and GPS disagree. An old GPS fix is stored with its own,
    older time; the difference after subtracting the nearest time zone shows it."""
    if local is None:
        return ()
    apart = local - satellite.replace(tzinfo=None)
    zone = round(apart / ZONE_STEP) * ZONE_STEP
    if abs(zone) > timedelta(hours=14) or abs(apart - zone) > MAX_CLOCK_ERROR:
        return (
            f"the GPS time {satellite:%Y-%m-%d %H:%M:%S} UTC and the camera's clock "
            f"({local:%Y-%m-%d %H:%M:%S}) do not differ by a time zone, so one of them is wrong. "
            "The GPS time is used.",
        )
    return ()


def _degrees(exif: Mapping[str, Any], name: str, plus: str, minus: str, limit: float) -> float:
    value, side = _tag(exif, name), _tag(exif, name + "Ref")
    parts = list(value) if isinstance(value, list | tuple) else [value]
    sexagesimal = [_number(part) for part in parts[:3]]
    letter = str(side).strip("\0 ").upper()[:1]
    if None in sexagesimal or letter not in (plus, minus):
        raise InputError(
            "the photo has no place (no GPS position in its EXIF); give latitude and longitude in "
            "degrees",
            key=name.lower(),
        )
    degrees = sum(float(part or 0) / 60**place for place, part in enumerate(sexagesimal))
    if not 0 <= degrees <= limit:
        raise InputError(
            f"is {degrees:g}° in the photo's GPS tag; expected 0° to {limit:g}°: give latitude and "
            "longitude in degrees",
            key=name.lower(),
        )
    return -degrees if letter == minus else degrees


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None
