"""Read one XML document from a zip of Metashape's into memory, within limits on size and
compression."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path
from typing import BinaryIO

from ...errors import UNREADABLE_NPZ, InputError
from ...files import open_regular
from ..parsing.xml_file import MAX_XML_BYTES
from .metashape_values import Source

DAMAGED = (*UNREADABLE_NPZ, RuntimeError, struct.error, OverflowError)
SUPPORTED_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # others need unlimited memory
MAX_DIRECTORY_BYTES = 1 << 26  # bytes of the list of files; a large project has 1 MB
MAX_COMPRESSION_RATIO = 500  # XML of numbers is compressed 3 to 30 times

# .ZIP File Format Specification (APPNOTE), 4.3.14–4.3.16
END, END_SIZE = b"PK\x05\x06", 22
LOCATOR, LOCATOR_SIZE = b"PK\x06\x07", 20
END64, END64_SIZE = b"PK\x06\x06", 56


def open_zip(file: BinaryIO, name: Source) -> zipfile.ZipFile:
    """The zip in an open file. Raises InputError."""
    try:
        if _directory_size(file) > MAX_DIRECTORY_BYTES:
            raise InputError("lists too many files for a Metashape project", file=name)
        file.seek(0)
        return zipfile.ZipFile(file)
    except DAMAGED as error:
        raise InputError(f"is not a valid zip ({_short(error)})", file=name) from error


def member(archive: zipfile.ZipFile, entry: str, name: Source) -> bytes | None:
    """The content of one entry; None where it does not exist. Raises InputError."""
    try:
        info = archive.getinfo(entry)
    except KeyError:
        return None
    dense = info.file_size > (1 << 20) and info.file_size > MAX_COMPRESSION_RATIO * max(
        1, info.compress_size
    )
    if info.file_size > MAX_XML_BYTES or dense:
        raise InputError(
            f"its {entry!r} unpacks to {info.file_size >> 20} MB, more than any tool writes",
            file=name,
        )
    if info.compress_type not in SUPPORTED_METHODS or info.flag_bits & 1:
        kind = "encrypted" if info.flag_bits & 1 else f"compressed with method {info.compress_type}"
        raise InputError(f"its {entry!r} is {kind}; expected a plain zip", file=name)
    try:
        with archive.open(info) as opened:
            data = opened.read(MAX_XML_BYTES + 1)
    except DAMAGED as error:
        raise InputError(f"its {entry!r} is damaged ({_short(error)})", file=name) from error
    if len(data) > MAX_XML_BYTES:
        raise InputError(f"its {entry!r} is larger than its declared size", file=name)
    return data


def document_in(path: Path, name: Source) -> bytes:
    """The doc.xml of a zip on disk. Raises InputError."""
    try:
        with open_regular(path) as file, open_zip(file, name) as archive:
            return document(archive, name)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=name) from error


def document(archive: zipfile.ZipFile, name: Source) -> bytes:
    """The doc.xml of an open zip. Raises InputError."""
    data = member(archive, "doc.xml", name)
    if data is None:
        raise InputError("holds no doc.xml; expected a zip written by Metashape", file=name)
    return data


def _directory_size(file: BinaryIO) -> int:
    """Bytes of the list of files at the end of the zip, which zipfile reads completely."""
    length = file.seek(0, 2)
    start = max(0, length - END_SIZE - 65535 - LOCATOR_SIZE)
    file.seek(start)
    tail = file.read(length - start)
    at = tail.rfind(END)
    if at < 0 or len(tail) - at < END_SIZE:
        raise zipfile.BadZipFile("no end of the list of files")
    size = int(struct.unpack_from("<I", tail, at + 12)[0])
    if size == 0xFFFFFFFF and tail[max(0, at - LOCATOR_SIZE) : at].startswith(LOCATOR):
        file.seek(int(struct.unpack_from("<Q", tail, at - LOCATOR_SIZE + 8)[0]))
        end64 = file.read(END64_SIZE)
        if not end64.startswith(END64) or len(end64) < END64_SIZE:
            raise zipfile.BadZipFile("no end of the list of files")
        size = int(struct.unpack_from("<Q", end64, 40)[0])
    return size


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:80] or type(error).__name__
