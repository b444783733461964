"""Identify an image file by its first bytes and check that it is safe to open."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
from .exr_check import check_exr
from .jpeg_check import check_jpeg, check_jpeg_header
from .per_file import once_per_file
from .png_check import SIGNATURE, check_png, check_png_header
from .radiance_header import check_hdr
from .tiff_check import check_tiff

KIND_OF = {
    ".exr": "openexr",
    ".tif": "tiff",
    ".tiff": "tiff",
    ".png": "png",
    ".jpg": "jpeg",
    ".jpeg": "jpeg",
    ".hdr": "hdr",
}
RAW = frozenset((".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2", ".pef", ".srw"))
READABLE_SUFFIXES = ", ".join((*KIND_OF, *sorted(RAW)))
MAX_SIDE = 1 << 17  # pixels
MAX_MEGAPIXELS = 270.0
"""Of one image: a texture of 16384 × 16384 has 268, the largest photos (shifted sensors) 240. A
file of 1 MB can declare far more, and would take many gigabytes of memory to decode."""
LIMIT_VARIABLE = "PATINA_MAX_MEGAPIXELS"
HEADS = {
    "openexr": rb"\x76\x2f\x31\x01",
    "png": re.escape(SIGNATURE),
    "jpeg": rb"\xff\xd8\xff",
    "tiff": rb"II[*+]\0|MM\0[*+]",
    "hdr": rb"#\?",
    "webp": rb"RIFF....WEBP",
    "heif": rb"....ftyp(?:heic|heix|mif1|avif)",
    "jpegxl": rb"\xff\x0a|\0\0\0\x0cJXL ",
    "bmp": rb"BM",
    "gif": rb"GIF8",
    "psd": rb"8BPS",
}


@dataclass(frozen=True)
class Container:
    """Format of an image file. kind: 'openexr', 'tiff' …, or '' where unknown; chunks: a PNG's
    declarations of its encoding; scale: the pixels of a .hdr must be divided by it (R, G, B)."""

    kind: str
    chunks: Mapping[str, bytes] = field(default_factory=dict)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


@once_per_file
def check_container(path: Path) -> Container:
    """Check a whole file before its pixels are read.

    The result is cached until the file changes. Raises InputError for a file that is missing, has
    the wrong suffix, is truncated or damaged (as far as that can be detected), or CMYK.
    """
    return _check(path, whole=True)


def check_header(path: Path) -> Container:
    """Check only the header of a file: like check_container, without the part after the header of
    a PNG or JPEG. Raises InputError."""
    return _check(path, whole=False)


def _check(path: Path, whole: bool) -> Container:
    if not path.is_file():
        raise InputError(
            "is not a file; expected an image" if path.exists() else "no such file; check the path",
            file=path,
        )
    try:
        with path.open("rb") as file:
            head = file.read(32)
        kind = next((k for k, p in HEADS.items() if re.match(p, head, re.DOTALL)), "")
        expected = KIND_OF.get(path.suffix.lower(), kind)
        if kind != expected:
            suffix = path.suffix.lower()
            if kind:
                raise InputError(
                    f"has the suffix {suffix} but its format is {kind}; rename it", file=path
                )
            raise InputError(
                f"has the suffix {suffix} but its content is not {expected.upper()}; export it "
                "again",
                file=path,
            )
        if kind == "png":
            return Container(kind, check_png(path) if whole else check_png_header(path))
        if kind == "jpeg":
            (check_jpeg if whole else check_jpeg_header)(path)
        elif kind == "tiff":
            check_tiff(path)
        elif kind == "openexr":
            check_exr(path)
        elif kind == "hdr":
            return Container(kind, scale=check_hdr(path))
        return Container(kind)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error


def _max_megapixels() -> float:
    """The limit that the user has set, or MAX_MEGAPIXELS. Raises InputError."""
    text = os.environ.get(LIMIT_VARIABLE, "")
    try:
        limit = float(text) if text else MAX_MEGAPIXELS
    except ValueError:
        limit = float("nan")
    if not 0 < limit < 1e6:
        raise InputError(f"found {text!r}; expected a number of million pixels", key=LIMIT_VARIABLE)
    return limit


def check_size(path: Path, width: int, height: int) -> None:
    """Raise InputError for an image that is empty or larger than any photo, before it is read.

    width, height: pixels, as the header states them.
    """
    most = _max_megapixels()
    if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE) or width * height > most * 1e6:
        raise InputError(
            f"has {width} × {height} pixels according to its header; expected at most {MAX_SIDE} "
            f"per side and {most:g} million in total; for larger images set the environment "
            f"variable {LIMIT_VARIABLE} to a number of million pixels",
            file=path,
        )
