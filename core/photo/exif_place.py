"""Find the EXIF block in each file format."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import BinaryIO

from .jpeg_check import APP1, EXIF, header_segments
from .tiff_tags import HEADS, TiffTags, read_tiff_tags

FUJI = b"FUJIFILMCCD-RAW"
CANON_CR3 = bytes.fromhex("85c0b687820f11e08111f4ce462b6a48")  # the box that holds CMT1 … CMT4
MAX_BLOCK_BYTES = 1 << 22
NO_TAGS = TiffTags({}, {}, {}, {})


def find_tags(path: Path) -> TiffTags:
    """The tags of a JPEG, PNG, TIFF or camera RAW file; empty where there are none.

    MakerNote blocks are not read. Only the start of a file is read.
    """
    with path.open("rb") as file:
        head = file.read(16)
        if head[:4] in HEADS:
            return read_tiff_tags(file) or NO_TAGS
        if head.startswith(b"\xff\xd8"):
            return _in_jpeg(file, 0)
        if head.startswith(b"\x89PNG"):
            return _in_png(file)
        if head.startswith(FUJI):
            file.seek(84)  # offset of the embedded JPEG, which carries the Exif block
            place = file.read(4)
            return _in_jpeg(file, int.from_bytes(place, "big")) if len(place) == 4 else NO_TAGS
        if head[4:8] == b"ftyp":
            return _in_cr3(file)
    return NO_TAGS


def _block(data: bytes) -> TiffTags:
    return read_tiff_tags(io.BytesIO(data)) or NO_TAGS


def _in_jpeg(file: BinaryIO, start: int) -> TiffTags:
    for marker, body in header_segments(file, start):
        if marker == APP1 and body.startswith(EXIF):
            return _block(body[len(EXIF) :])
    return NO_TAGS


def _in_png(file: BinaryIO) -> TiffTags:
    file.seek(8)
    while len(head := file.read(8)) == 8:
        length, kind = struct.unpack(">I4s", head)
        if kind == b"eXIf" and length <= MAX_BLOCK_BYTES:
            return _block(file.read(length))
        file.seek(length + 4, io.SEEK_CUR)
    return NO_TAGS


def _in_cr3(file: BinaryIO) -> TiffTags:
    """Canon stores the main, EXIF and GPS directories as three separate TIFF structures (boxes
    CMT1, CMT2, CMT4 in moov)."""
    file.seek(0)
    moov = dict(_boxes(file.read(MAX_BLOCK_BYTES))).get(b"moov", b"")
    holder = next((b[16:] for k, b in _boxes(moov) if k == b"uuid" and b[:16] == CANON_CR3), b"")
    parts = {kind: _block(body).main for kind, body in _boxes(holder)}
    return TiffTags(parts.get(b"CMT1", {}), parts.get(b"CMT2", {}), parts.get(b"CMT4", {}), {})


def _boxes(data: bytes) -> list[tuple[bytes, bytes]]:
    """(kind, body) of the boxes of ISO/IEC 14496-12."""
    found, place = [], 0
    while place + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, place)
        head = 8
        if length == 1 and place + 16 <= len(data):
            length, head = struct.unpack_from(">Q", data, place + 8)[0], 16
        if length < head:
            break
        found.append((kind, data[place + head : place + length]))
        place += length
    return found
