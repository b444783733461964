"""Read a photo's EXIF: exposure, lens, time and place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone
from fractions import Fraction
from pathlib import Path

from ..errors import InputError
from .exif_place import find_tags
from .image import attributes
from .per_file import once_per_file
from .tiff_tags import Value

Tags = dict[int, Value]


@dataclass(frozen=True)
class Exif:
    """Exif 2.32 / 3.0 fields of one photo; None where the file does not have a field.

    exposure_time: s; f_number; iso; focal_length, focal_length_35mm: mm; datetime_original: the
    camera's clock WITHOUT time zone (DateTimeOriginal, never ModifyDate); offset_original: its
    offset from UTC; latitude, longitude: degrees (north and east positive); altitude: m above sea
    level; gps_utc: UTC time of the GPS receiver; orientation: 1..8, how a viewer would rotate the
    picture. Patina never applies it. flash_fired: a flash, also one away from the camera that it
    set off.
    """

    exposure_time: float | None = None
    f_number: float | None = None
    iso: float | None = None
    focal_length: float | None = None
    focal_length_35mm: float | None = None
    datetime_original: datetime | None = None
    offset_original: timedelta | None = None
    latitude: float | None = None
    longitude: float | None = None
    altitude: float | None = None
    gps_utc: datetime | None = None
    make: str | None = None
    model: str | None = None
    lens: str | None = None
    orientation: int | None = None
    flash_fired: bool | None = None

    @property
    def relative_exposure(self) -> float | None:
        """t · ISO / (100 · N²): radiance = pixel / relative_exposure, up to one factor per camera.

        Proportional to the sensor's exposure per unit of radiance, times its gain (the exposure
        equation, ISO 2720). None unless time, f-number and ISO are all known. Cameras write
        rounded values: 1/60 s is really 1/64, f/5.6 is 5.66, f/13 is 12.7.
        """
        if self.missing:
            return None
        assert self.exposure_time and self.f_number and self.iso
        return self.exposure_time * self.iso / (100.0 * self.f_number**2)

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of the fields that relative_exposure needs and the file does not have."""
        needed = {
            "exposure time": self.exposure_time,
            "f-number": self.f_number,
            "ISO": self.iso,
        }
        return tuple(name for name, value in needed.items() if value is None)

    @property
    def utc(self) -> datetime | None:
        """Time of the photo in UTC: the camera's clock with its offset, otherwise GPS."""
        if self.datetime_original and self.offset_original is not None:
            zone = timezone(self.offset_original)
            return self.datetime_original.replace(tzinfo=zone).astimezone(UTC)
        return self.gps_utc


@once_per_file
def read_exif(path: Path) -> Exif:
    """EXIF of a JPEG, TIFF, PNG, EXR or camera RAW file; all fields None where it has none.

    The result is cached until the file changes. A damaged field counts as missing. Raises
    InputError only where the file does not exist or cannot be read.
    """
    if not path.is_file():
        raise InputError(
            "is not a file; expected an image" if path.exists() else "no such file; check the path",
            file=path,
        )
    try:
        if path.suffix.lower() == ".exr":
            return _from_exr(attributes(path))
        tags = find_tags(path)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    main, exif, gps = tags.main, {**tags.main, **tags.exif}, tags.gps
    return Exif(
        exposure_time=_positive(exif, 0x829A) or _apex(exif, 0x9201, -1.0),
        f_number=_positive(exif, 0x829D) or _apex(exif, 0x9202, 0.5),
        iso=_iso(exif),
        focal_length=_positive(exif, 0x920A),
        focal_length_35mm=_positive(exif, 0xA405),
        datetime_original=_time(_text(exif, 0x9003), _text(exif, 0x9291)),
        offset_original=parse_offset(_text(exif, 0x9011)),
        latitude=_degrees(gps, 2, 1, "NS", 90.0),
        longitude=_degrees(gps, 4, 3, "EW", 180.0),
        altitude=_altitude(gps),
        gps_utc=_gps_time(gps),
        make=_text(main, 0x010F),
        model=_text(main, 0x0110),
        lens=_text(exif, 0xA434),
        orientation=_orientation(main),
        flash_fired=_flash_fired(_numbers(exif, 0x9209)),
    )


def _from_exr(found: dict[str, object]) -> Exif:
    """EXIF from the standard attributes of OpenEXR and from EXIF names that converters copy.

    capDate is not used, because many programs store the time of writing there.
    """

    def number(*names: str) -> float | None:
        for name in names:
            value = found.get(name)
            if isinstance(value, int | float) and math.isfinite(value):
                return float(value)
        return None

    def positive(*names: str) -> float | None:
        value = number(*names)
        return value if value is not None and value > 0 else None

    def text(*names: str) -> str | None:
        values = (found.get(name) for name in names)
        return next((v.strip() for v in values if isinstance(v, str) and v.strip()), None)

    latitude, longitude = number("latitude"), number("longitude")
    placed = latitude is not None and longitude is not None
    placed = placed and abs(latitude or 0) <= 90 and abs(longitude or 0) <= 180
    turned, flash = number("Orientation"), number("Exif:Flash")
    return Exif(
        exposure_time=positive("ExposureTime"),
        f_number=positive("FNumber"),
        iso=positive("isoSpeed", "Exif:PhotographicSensitivity", "Exif:ISOSpeedRatings"),
        focal_length=positive("Exif:FocalLength", "nominalFocalLength"),
        focal_length_35mm=positive("Exif:FocalLengthIn35mmFilm"),
        datetime_original=_time(text("Exif:DateTimeOriginal")),
        offset_original=parse_offset(text("Exif:OffsetTimeOriginal")),
        latitude=latitude if placed else None,
        longitude=longitude if placed else None,
        altitude=number("altitude") if placed else None,
        make=text("cameraMake", "Make"),
        model=text("cameraModel", "Model"),
        lens=text("lensModel", "Exif:LensModel"),
        orientation=int(turned) if turned is not None and turned in range(1, 9) else None,
        flash_fired=_flash_fired([flash] if flash is not None else []),
    )


def _numbers(tags: Tags, tag: int) -> list[float | None]:
    value = tags.get(tag)
    if not isinstance(value, tuple):
        return []
    found: list[float | None] = []
    for number in value:
        known = number is not None and math.isfinite(number)
        found.append(float(number) if known and number is not None else None)
    return found


def _positive(tags: Tags, tag: int) -> float | None:
    values = _numbers(tags, tag)
    return values[0] if values and values[0] and values[0] > 0 else None


def _apex(tags: Tags, tag: int, power: float) -> float | None:
    """2^(power · value): time from ShutterSpeedValue (−1), f-number from ApertureValue (1/2)."""
    values = _numbers(tags, tag)
    if not values or values[0] is None or abs(values[0]) > 60:
        return None
    return 2.0 ** (power * values[0])


def _iso(tags: Tags) -> float | None:
    """PhotographicSensitivity; it is limited to 65535, larger values are in the 32-bit fields."""
    iso = _positive(tags, 0x8827)
    if iso is None or iso >= 65535:
        for tag in (0x8833, 0x8832, 0x8831):  # ISOSpeed, RecommendedExposureIndex, SOS
            iso = _positive(tags, tag) or iso
            if iso and iso != 65535:
                break
    return iso


def _text(tags: Tags, tag: int) -> str | None:
    value = tags.get(tag)
    if isinstance(value, bytes):  # some cameras write text as UNDEFINED
        value = value.split(b"\0", 1)[0].decode("utf-8", "replace").strip()
    return " ".join(value.split()) or None if isinstance(value, str) else None


def _time(text: str | None, subseconds: str | None = None) -> datetime | None:
    """EXIF's 'YYYY:MM:DD HH:MM:SS'; None for blanks, zeros and impossible dates."""
    if text is None:
        return None
    try:
        when = datetime.strptime(text[:19].replace("-", ":").replace("T", " "), "%Y:%m:%d %H:%M:%S")
    except ValueError:
        return None
    if subseconds and subseconds.isascii() and subseconds.isdigit():
        when += timedelta(seconds=float("0." + subseconds[:6]))
    return when


def parse_offset(text: str | None) -> timedelta | None:
    """'+09:00' → 9 h (Exif OffsetTimeOriginal); None for anything else."""
    if text == "Z":
        return timedelta(0)
    if text is None or len(text) != 6 or text[0] not in "+-" or text[3] != ":":
        return None
    digits = text[1:3] + text[4:]
    if not (digits.isascii() and digits.isdigit()):
        return None
    hours, minutes = int(digits[:2]), int(digits[2:])
    if hours > 14 or minutes > 59:
        return None
    return timedelta(hours=hours, minutes=minutes) * (-1 if text[0] == "-" else 1)


def _degrees(gps: Tags, tag: int, reference: int, letters: str, limit: float) -> float | None:
    """Signed degrees from degrees, minutes, seconds and a letter; letters: positive, negative."""
    parts, letter = _numbers(gps, tag), (_text(gps, reference) or "").upper()[:1]
    if not parts or parts[0] is None or letter not in letters or not letter:
        return None
    # cameras that write decimal degrees write minutes and seconds as 0/0
    degrees = sum((p or 0.0) / scale for p, scale in zip(parts, (1.0, 60.0, 3600.0), strict=False))
    if not 0.0 <= degrees <= limit:
        return None
    return -degrees if letter == letters[1] else degrees


def _altitude(gps: Tags) -> float | None:
    metres = _numbers(gps, 6)
    if not metres or metres[0] is None or abs(metres[0]) > 1e5:
        return None
    below = gps.get(5)
    sign = below[:1] in (b"\x01", (1,)) if isinstance(below, bytes | tuple) else False
    return -metres[0] if sign else metres[0]


def _gps_time(gps: Tags) -> datetime | None:
    """GPSDateStamp and GPSTimeStamp; both are UTC."""
    date, clock = _text(gps, 0x1D), gps.get(7)
    if date is None or not isinstance(clock, tuple) or len(clock) != 3 or None in clock:
        return None
    hours, minutes, seconds = (Fraction(part) for part in clock if part is not None)
    day = _time(date[:10] + " 00:00:00")
    if day is None or not (0 <= hours < 24 and 0 <= minutes < 60 and 0 <= seconds < 61):
        return None
    try:
        offset = timedelta(seconds=float(3600 * hours + 60 * minutes + seconds))
        return day.replace(tzinfo=UTC) + offset
    except OverflowError:
        return None


def _flash_fired(values: Sequence[float | None]) -> bool | None:
    """Bit 0 of Exif's Flash."""
    first = values[0] if values else None
    return bool(int(first) & 1) if first is not None and 0 <= first < 256 else None


def _orientation(main: Tags) -> int | None:
    values = _numbers(main, 0x0112)
    turned = values[0] if values else None
    return int(turned) if turned is not None and turned in range(1, 9) else None
