"""Check the header of an OpenEXR file before a library reads it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

from ..errors import InputError
from .metadata_limit import check_metadata_size

MAX_NAME_BYTES = 256  # OpenEXR file layout: at most 255 characters and a NUL
MAX_ATTRIBUTES = 10_000  # of all parts; a render has some ten for each
MULTIPART = 0x1000  # flag in the second word of the file


def check_exr(path: Path) -> None:
    """Raise InputError where a value in the header is too large, or the header is damaged."""
    with path.open("rb") as file:
        head = file.read(8)
        multipart = len(head) == 8 and bool(struct.unpack("<4xI", head)[0] & MULTIPART)
        empty = not multipart  # a second NUL ends the headers of a file of several parts
        for _ in range(MAX_ATTRIBUTES):
            name = _text(file)
            if name == b"":
                if empty:
                    return
                empty = True
                continue
            empty = not multipart
            kind, size = _text(file), file.read(4)
            if name is None or kind is None or len(size) < 4:
                break
            (length,) = struct.unpack("<i", size)
            if length < 0:
                break
            check_metadata_size(path, f"the attribute {name.decode('utf-8', 'replace')!r}", length)
            file.seek(length, 1)
    raise InputError("is truncated or damaged (its EXR header); export it again", file=path)


def _text(file: BinaryIO) -> bytes | None:
    """Bytes to the next NUL; None where there is none."""
    start = file.tell()
    text, found, _ = file.read(MAX_NAME_BYTES).partition(b"\0")
    file.seek(start + len(text) + 1)
    return text if found else None
