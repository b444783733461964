"""Is a JPEG whole? Its decoder fills what is missing with grey and says nothing."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError

SOI, EOI, SOS, APP1 = 0xD8, 0xD9, 0xDA, 0xE1
FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # SOF0..SOF15 without DHT, JPG, DAC
MARKER = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")  # in a scan: not stuffing, restart or fill
MAX_BYTES = 1 << 30
EXIF = b"Exif\0\0"


@dataclass(frozen=True)
class JpegHead:
    """Size in pixels, number of colour components, and the Exif block (a TIFF structure)."""

    width: int
    height: int
    components: int
    exif: bytes | None


def check_jpeg(path: Path) -> JpegHead:
    """Walk the markers (ITU-T T.81, annex B). Raise InputError for a file that is no JPEG, is
    truncated, or is CMYK."""
    if path.stat().st_size > MAX_BYTES:
        raise InputError("is larger than a JPEG can sensibly be (1 GiB)", file=path)
    data = path.read_bytes()
    frame: tuple[int, int, int] | None = None
    exif, scans = None, 0
    for marker, body in segments(data):
        if marker in FRAMES and len(body) >= 6 and frame is None:
            height, width, components = struct.unpack_from(">HHB", body, 1)
            frame = width, height, components
        elif marker == APP1 and body.startswith(EXIF) and exif is None:
            exif = body[len(EXIF) :]
        elif marker == SOS:
            scans += 1
        elif marker == EOI and frame and scans:
            if frame[2] == 4:
                raise InputError(
                    "is a CMYK JPEG, made for printing; expected RGB or grey; "
                    "export it again as RGB",
                    file=path,
                )
            return JpegHead(*frame, exif)
    raise InputError("is truncated or damaged (the end of the JPEG is missing)", file=path)


def segments(data: bytes) -> Iterator[tuple[int, bytes]]:
    """(marker, body) of each segment, until the end of the image or of what can be followed."""
    place = 2
    while place + 2 <= len(data):
        if data[place] != 0xFF:
            return
        marker = data[place + 1]
        if marker == 0xFF:  # fill byte
            place += 1
            continue
        if marker == EOI:
            yield marker, b""
            return
        if marker == 0x01 or 0xD0 <= marker <= SOI:
            place += 2
            continue
        if place + 4 > len(data):
            return
        end = place + 2 + int.from_bytes(data[place + 2 : place + 4], "big")
        if end > len(data):
            return
        yield marker, data[place + 4 : end]
        if marker == SOS:
            following = MARKER.search(data, end)
            if following is None:
                return
            end = following.start()
        place = end
