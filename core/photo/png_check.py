"""Check that a PNG is complete by its checksums, and read its declarations of the encoding."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

from ..errors import InputError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
MAX_DECLARATION_BYTES = 1 << 20
DECLARATIONS = (b"cICP", b"iCCP", b"sRGB", b"gAMA", b"eXIf")


def check_png(path: Path) -> dict[str, bytes]:
    """Check a PNG; raises InputError for a file that is not a PNG, is truncated, or has a damaged
    chunk.

    Returns {chunk type: data} of the chunks that declare the encoding, as far as the file has them
    (cICP, iCCP, sRGB, gAMA, eXIf: the first of each, PNG specification, third edition, section
    11.3).
    """
    return _check(path, whole=True)


def check_png_header(path: Path) -> dict[str, bytes]:
    """The same for the part before the pixels: nothing is read after the head of the first IDAT
    chunk, and only the head of chunks larger than MAX_DECLARATION_BYTES."""
    return _check(path, whole=False)


def _check(path: Path, whole: bool) -> dict[str, bytes]:
    size, place = path.stat().st_size, len(SIGNATURE)
    found: dict[str, bytes] = {}
    with path.open("rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            raise InputError(
                "has the suffix .png but is not a PNG image; export it again", file=path
            )
        while place + 12 <= size:
            length, kind = struct.unpack(">I4s", file.read(8))
            if not whole and kind == b"IDAT":
                return found
            if place + 12 + length > size:
                break
            if not whole and length > MAX_DECLARATION_BYTES:
                place += 12 + length
                file.seek(place)
                continue
            data = file.read(length)
            if zlib.crc32(data, zlib.crc32(kind)) != struct.unpack(">I", file.read(4))[0]:
                raise InputError(
                    f"is damaged (its {kind.decode('latin-1')!r} chunk); export it again", file=path
                )
            if kind == b"IEND":
                return found
            if kind in DECLARATIONS and length <= MAX_DECLARATION_BYTES:
                found.setdefault(kind.decode(), data)
            place += 12 + length
    raise InputError("is truncated; export or copy it again", file=path)
