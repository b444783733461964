"""Read the tags of a TIFF structure: a TIFF, most camera RAW files, or an EXIF block.

TIFF 6.0 (Adobe, 1992), BigTIFF, and the variants of the first four bytes that Olympus and
Panasonic use. Every count, offset and denominator is checked, because files may be damaged.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from fractions import Fraction
from typing import BinaryIO

SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4,
         16: 8, 17: 8, 18: 8}  # fmt: skip
CODES = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 11: "f", 12: "d", 13: "I",
         16: "Q", 17: "q", 18: "Q"}  # fmt: skip
HEADS = {
    b"II*\0": "<", b"MM\0*": ">", b"II+\0": "<", b"MM\0+": ">",
    b"IIRO": "<", b"IIRS": "<", b"MMOR": ">", b"IIU\0": "<",
}  # fmt: skip
MAX_TAGS, MAX_VALUE_BYTES, MAX_FILE_BYTES = 2000, 1 << 16, 1 << 40

Value = str | bytes | tuple[int | float | Fraction | None, ...]


@dataclass(frozen=True)
class TiffTags:
    """Tags of the directories that describe a photo: {tag number: value}.

    A value is text (type ASCII, cut at the first NUL), bytes (type UNDEFINED) or a tuple of
    numbers; rationals are Fractions, and None where the denominator is zero. sizes: bytes of each
    value, also of those that are not read.
    """

    main: dict[int, Value]
    exif: dict[int, Value]
    gps: dict[int, Value]
    interoperability: dict[int, Value]
    sizes: dict[int, int] = field(default_factory=dict)


def read_tiff_tags(file: BinaryIO, start: int = 0) -> TiffTags | None:
    """The first directory and those it points to; None where no TIFF structure starts there.

    start: byte where the structure (its byte order mark) begins. Damaged entries are ignored.
    """
    file.seek(start)
    head = file.read(16)
    order = HEADS.get(head[:4])
    if order is None or len(head) < 8:
        return None
    big = b"+" in head[2:4]
    if big and len(head) < 16:
        return None
    offset = struct.unpack_from(order + ("Q" if big else "I"), head, 8 if big else 4)[0]
    sizes: dict[int, int] = {}
    main = _directory(file, start, offset, order, big, sizes)

    def pointed(directory: dict[int, Value], tag: int) -> dict[int, Value]:
        value = directory.get(tag)
        place = value[0] if isinstance(value, tuple) else None
        if not isinstance(place, int):
            return {}
        return _directory(file, start, place, order, big, sizes)

    exif = pointed(main, 0x8769)
    gps, more = pointed(main, 0x8825), pointed(exif, 0xA005)
    return TiffTags(main, exif, gps, more, sizes)


def _read(file: BinaryIO, place: int, size: int) -> bytes:
    if not 0 <= place < MAX_FILE_BYTES:
        return b""
    file.seek(place)
    return file.read(size)


def _directory(
    file: BinaryIO, start: int, offset: int, order: str, big: bool, sizes: dict[int, int]
) -> dict[int, Value]:
    """{tag: value} of one directory; entries that point outside the file are ignored. sizes: gets
    {tag: bytes} of all entries."""
    count_code, entry_code, inline = ("Q", "HHQ8s", 8) if big else ("H", "HHI4s", 4)
    width = struct.calcsize(order + count_code)
    head = _read(file, start + offset, width)
    if len(head) < width:
        return {}
    count = min(struct.unpack(order + count_code, head)[0], MAX_TAGS)
    size = struct.calcsize(order + entry_code)
    entries = _read(file, start + offset + width, count * size)
    found: dict[int, Value] = {}
    for place in range(0, len(entries) - size + 1, size):
        tag, kind, number, field = struct.unpack_from(order + entry_code, entries, place)
        length = SIZES.get(kind, 0) * number
        sizes[tag] = max(length, sizes.get(tag, 0))
        if not 0 < length <= MAX_VALUE_BYTES or tag in found:
            continue
        if length > inline:
            at = struct.unpack(order + ("Q" if big else "I"), field)[0]
            field = _read(file, start + at, length)
        if len(field) >= length:
            found[tag] = _value(field[:length], kind, number, order)
    return found


def _value(data: bytes, kind: int, number: int, order: str) -> Value:
    if kind == 2:
        return data.split(b"\0", 1)[0].decode("utf-8", "replace").strip()
    if kind == 7:
        return data
    if kind in (5, 10):
        parts = struct.unpack(f"{order}{2 * number}{'I' if kind == 5 else 'i'}", data)
        pairs = zip(parts[::2], parts[1::2], strict=True)
        return tuple(Fraction(top, bottom) if bottom else None for top, bottom in pairs)
    return tuple(struct.unpack(f"{order}{number}{CODES[kind]}", data))
