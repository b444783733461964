"""Is a PNG whole? Its checksums tell before any reader opens it; and its small chunks."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

from ..errors import InputError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
SMALL = 1 << 20
DECLARATIONS = (b"cICP", b"iCCP", b"sRGB", b"gAMA", b"eXIf")


def check_png(path: Path) -> dict[str, bytes]:
    """Raise InputError for a file that is no PNG, is truncated, or has a damaged chunk.

    Returns the chunks that say what the numbers mean (cICP, iCCP, sRGB, gAMA, eXIf: the first of
    each, PNG specification, third edition, section 11.3), as far as the file has them.
    """
    return _check(path, whole=True)


def check_png_header(path: Path) -> dict[str, bytes]:
    """The same for what stands before the pixels: no byte after the first IDAT chunk's head is
    read, and of larger chunks than SMALL the head only."""
    return _check(path, whole=False)


def _check(path: Path, whole: bool) -> dict[str, bytes]:
    size, place = path.stat().st_size, len(SIGNATURE)
    found: dict[str, bytes] = {}
    with path.open("rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            raise InputError("is named .png, but is no PNG image", file=path)
        while place + 12 <= size:
            length, kind = struct.unpack(">I4s", file.read(8))
            if not whole and kind == b"IDAT":
                return found
            if place + 12 + length > size:
                break
            if not whole and length > SMALL:
                place += 12 + length
                file.seek(place)
                continue
            data = file.read(length)
            if zlib.crc32(data, zlib.crc32(kind)) != struct.unpack(">I", file.read(4))[0]:
                raise InputError(f"is damaged (its {kind.decode('latin-1')!r} chunk)", file=path)
            if kind == b"IEND":
                return found
            if kind in DECLARATIONS and length <= SMALL:
                found.setdefault(kind.decode(), data)
            place += 12 + length
    raise InputError("is truncated", file=path)
