"""What a file is, by its first bytes, and whether it may be opened at all."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
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
READ = ", ".join((*KIND_OF, *sorted(RAW)))
LARGEST_SIDE, MOST_PIXELS = 1 << 17, 300_000_000
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
    """kind: 'openexr', 'tiff' … or '' where it is unknown; chunks: a PNG's declarations; scale:
    what the pixels of a .hdr are to be divided by."""

    kind: str
    chunks: Mapping[str, bytes] = field(default_factory=dict)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


@once_per_file
def check_container(path: Path) -> Container:
    """Check a whole file before its pixels are read. Raises InputError for one that is missing,
    named as another kind than it is, truncated or damaged as far as that can be seen, or CMYK.

    A file that stays the same is read once, however often this is called."""
    return _check(path, whole=True)


def check_header(path: Path) -> Container:
    """Check a file's header, before its size is asked for: the same as check_container but for
    what lies after the header of a PNG or JPEG. Raises InputError."""
    return _check(path, whole=False)


def _check(path: Path, whole: bool) -> Container:
    if not path.is_file():
        raise InputError("is not a file" if path.exists() else "no such file", file=path)
    try:
        with path.open("rb") as file:
            head = file.read(32)
        kind = next((k for k, p in HEADS.items() if re.match(p, head, re.DOTALL)), "")
        expected = KIND_OF.get(path.suffix.lower(), kind)
        if kind != expected:
            suffix = path.suffix.lower()
            if kind:
                raise InputError(
                    f"is named {suffix}, but holds a {kind} image; rename it", file=path
                )
            raise InputError(f"is named {suffix}, but is no {expected.upper()} image", file=path)
        if kind == "png":
            return Container(kind, check_png(path) if whole else check_png_header(path))
        if kind == "jpeg":
            (check_jpeg if whole else check_jpeg_header)(path)
        elif kind == "tiff":
            check_tiff(path)
        elif kind == "hdr":
            return Container(kind, scale=check_hdr(path))
        return Container(kind)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error


def check_size(path: Path, width: int, height: int) -> None:
    """Raise InputError for an image that is empty or larger than any photo, before it is read."""
    if not (0 < width <= LARGEST_SIDE and 0 < height <= LARGEST_SIDE) or (
        width * height > MOST_PIXELS
    ):
        raise InputError(
            f"says it has {width} × {height} pixels; at most {LARGEST_SIDE} a side and "
            f"{MOST_PIXELS // 10**6} million in all are read",
            file=path,
        )
