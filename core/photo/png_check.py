"""Is a PNG whole? Its checksums say so before any reader is asked."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

from ..errors import InputError

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def check_png(path: Path) -> None:
    """Raise InputError for a file that is no PNG, is truncated, or has a damaged chunk."""
    data = path.read_bytes()
    if not data.startswith(SIGNATURE):
        raise InputError("is named .png, but is no PNG image", file=path)
    place = len(SIGNATURE)
    while place + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, place)
        kind, end = data[place + 4 : place + 8], place + 8 + length
        if end + 4 > len(data):
            break
        if zlib.crc32(data[place + 4 : end]) != struct.unpack_from(">I", data, end)[0]:
            raise InputError(f"is damaged (its {kind.decode('latin-1')} chunk)", file=path)
        if kind == b"IEND":
            return
        place = end + 4
    raise InputError("is truncated", file=path)
