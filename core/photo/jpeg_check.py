"""Check that a JPEG is complete; the decoder fills missing parts with grey without an error."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ..errors import InputError

SOI, EOI, SOS, APP1 = 0xD8, 0xD9, 0xDA, 0xE1
FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # SOF0..SOF15 without DHT, JPG, DAC
MARKER = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")  # in a scan: not stuffing, restart or fill
MAX_BYTES = 1 << 30
MAX_HEADER = 1 << 22  # bytes; profiles and previews of cameras are smaller
EXIF = b"Exif\0\0"


def check_jpeg(path: Path) -> None:
    """Follow the markers (ITU-T T.81, annex B). Raises InputError for a file that is not a JPEG,
    is truncated, or is CMYK."""
    if path.stat().st_size > MAX_BYTES:
        raise InputError("is too large for a JPEG; expected at most 1 GiB", file=path)
    data = path.read_bytes()
    components, scans = 0, 0
    for marker, body in segments(data):
        if marker in FRAMES and len(body) >= 6 and not components:
            components = body[5]
        elif marker == SOS:
            scans += 1
        elif marker == EOI and components and scans:
            _check_components(path, components)
            return
    raise InputError("is truncated or damaged (the end of the JPEG is missing)", file=path)


def check_jpeg_header(path: Path) -> None:
    """The same check for the segments before the first scan; reads at most MAX_HEADER bytes.
    Raises InputError."""
    with path.open("rb") as file:
        for marker, body in header_segments(file):
            if marker in FRAMES and len(body) >= 6:
                _check_components(path, body[5])
                return
    raise InputError("is truncated or damaged (the JPEG's header is incomplete)", file=path)


def _check_components(path: Path, components: int) -> None:
    if components == 4:
        raise InputError(
            "is a CMYK JPEG for printing; expected RGB or grey: export it again as RGB",
            file=path,
        )


def header_segments(file: BinaryIO, start: int = 0) -> Iterator[tuple[int, bytes]]:
    """(marker, body) of the segments before the first scan of the JPEG that begins at byte
    ``start``. Reads one segment at a time, at most MAX_HEADER bytes in total."""
    file.seek(start + 2)
    left = MAX_HEADER
    while left > 0 and file.read(1) == b"\xff":
        code = file.read(1)
        while code == b"\xff" and left > 0:  # fill bytes
            code, left = file.read(1), left - 1
        if not code or code[0] in (EOI, SOS):
            return
        left -= 2
        marker = code[0]
        if marker == 0x01 or 0xD0 <= marker <= SOI:  # no body follows
            continue
        length = int.from_bytes(file.read(2), "big") - 2
        body = file.read(max(length, 0))
        if length < 0 or len(body) < length:
            return
        left -= 2 + length
        yield marker, body


def segments(data: bytes) -> Iterator[tuple[int, bytes]]:
    """(marker, body) of each segment, until the end of the image or the first damaged segment."""
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
