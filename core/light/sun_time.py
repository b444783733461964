"""When and where a photo was taken: written by hand, or by the camera (EXIF)."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from ..errors import InputError

AGREE = timedelta(minutes=2)  # a camera's clock and its GPS differ by less, if both are right
QUARTER = timedelta(minutes=15)  # zones are whole quarters of an hour from UTC
_STAMP = re.compile(r"(\d{4}):(\d\d):(\d\d)[ T](\d\d):(\d\d):(\d\d)")
_OFFSET = re.compile(r"([+-])(\d\d):?(\d\d)|Z")


@dataclass(frozen=True)
class PhotoTime:
    """time: with its zone. source: the tags it came from. notes: what to doubt about it."""

    time: datetime
    source: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PhotoPlace:
    """latitude, longitude: degrees, north and east positive. altitude: metres, None if unknown."""

    latitude: float
    longitude: float
    altitude: float | None


def parse_time(value: str | datetime, key: str = "time") -> datetime:
    """A time of the user's: TOML's own date and time, or ISO 8601 text, always with a zone.

    Raises InputError, naming ``key``, where it is no time or has no zone.
    """
    if isinstance(value, str):
        try:
            time = datetime.fromisoformat(value.strip())
        except ValueError:
            raise InputError(
                f"{value[:40]!r} is no date and time; expected one like 2018-06-01T12:00:00+09:00",
                key=key,
            ) from None
    elif isinstance(value, datetime):
        time = value
    else:
        raise InputError(
            f"{str(value)[:40]!r} has no time of day or is no date; expected one like "
            "2018-06-01T12:00:00+09:00",
            key=key,
        )
    if time.tzinfo is None:
        raise InputError(
            f"{time.isoformat()} has no zone; add it, as in {time.isoformat()}+02:00, or Z for "
            "UTC (an hour is about 14° of the sun's azimuth)",
            key=key,
        )
    return time


def photo_time(exif: Mapping[str, Any]) -> PhotoTime:
    """The moment of a photo from its EXIF tags; keys may carry the prefix "Exif:" or "GPS:".

    DateTimeOriginal with OffsetTimeOriginal, else the GPS date and time stamps (UTC); never
    DateTime (ModifyDate), which an editor writes. Raises InputError where no zone is known.
    """
    local = _stamp(_tag(exif, "DateTimeOriginal"))
    zone = _offset(_tag(exif, "OffsetTimeOriginal"))
    satellite = _satellite_time(exif)
    if local is not None and zone is not None:
        time = (local - zone).replace(tzinfo=UTC)
        notes: tuple[str, ...] = ()
        if satellite is not None and abs(satellite - time) > AGREE:
            notes = (
                f"the camera's clock says {time:%Y-%m-%d %H:%M:%S} UTC, its GPS "
                f"{satellite:%Y-%m-%d %H:%M:%S}; the clock is used",
            )
        return PhotoTime(time, "DateTimeOriginal and OffsetTimeOriginal", notes)
    if satellite is not None:
        return PhotoTime(satellite, "GPSDateStamp and GPSTimeStamp", _clock_notes(local, satellite))
    if local is not None:
        raise InputError(
            f"the photo's time {local:%Y-%m-%d %H:%M:%S} has no zone (no OffsetTimeOriginal, no "
            f'GPS time); give it: time = "{local:%Y-%m-%dT%H:%M:%S}+02:00" with its own offset',
            key="time",
        )
    raise InputError(
        "the photo does not say when it was taken (no DateTimeOriginal in its EXIF); give a time "
        "with its zone, like 2018-06-01T12:00:00+09:00",
        key="time",
    )


def photo_place(exif: Mapping[str, Any]) -> PhotoPlace:
    """Where a photo was taken, from its GPS tags. Raises InputError where they do not say."""
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
    """EXIF's "YYYY:MM:DD HH:MM:SS"; cameras without a set clock write zeros or blanks."""
    found = _STAMP.match(value.strip()) if isinstance(value, str) else None
    if found is None:
        return None
    try:
        time = datetime(*(int(part) for part in found.groups()))  # type: ignore[arg-type]
    except ValueError:
        return None
    # room for any zone within what a datetime can hold
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
        if not (0 <= hours < 24 and 0 <= minutes < 60 and 0 <= seconds < 61):  # NaN fails too
            return None
    except (TypeError, ValueError):
        return None
    day = _stamp(date.strip().replace("-", ":")[:10] + " 00:00:00")
    if day is None:
        return None
    return (day + timedelta(hours=hours, minutes=minutes, seconds=seconds)).replace(tzinfo=UTC)


def _clock_notes(local: datetime | None, satellite: datetime) -> tuple[str, ...]:
    """A fix taken before the photo is written with its own, older time: what is left after the
    nearest zone tells by how much."""
    if local is None:
        return ()
    apart = local - satellite.replace(tzinfo=None)
    zone = round(apart / QUARTER) * QUARTER
    if abs(zone) > timedelta(hours=14) or abs(apart - zone) > AGREE:
        return (
            f"the GPS time {satellite:%Y-%m-%d %H:%M:%S} UTC is no whole zone away from the "
            f"camera's clock ({local:%Y-%m-%d %H:%M:%S}): one of the two is wrong; GPS is used",
        )
    return ()


def _degrees(exif: Mapping[str, Any], name: str, plus: str, minus: str, limit: float) -> float:
    value, side = _tag(exif, name), _tag(exif, name + "Ref")
    parts = list(value) if isinstance(value, list | tuple) else [value]
    numbers = [_number(part) for part in parts[:3]]
    letter = str(side).strip("\0 ").upper()[:1]
    if None in numbers or letter not in (plus, minus):
        raise InputError(
            "the photo does not say where it was taken (no GPS position in its EXIF); give "
            "latitude and longitude in degrees",
            key=name.lower(),
        )
    degrees = sum(float(part or 0) / 60**place for place, part in enumerate(numbers))
    if not 0 <= degrees <= limit:
        raise InputError(f"the photo's GPS tag says {degrees:g}°", key=name.lower())
    return -degrees if letter == minus else degrees


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None
