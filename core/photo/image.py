"""Read and write images with OpenImageIO.

The OpenEXR wheel is not used: inside Blender its symbols are replaced by those of Blender's own
OpenEXR library, and writing crashes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from ..errors import InputError, PatinaError
from ..files import atomic_path
from . import raw
from .container import RAW, Container, check_container, check_header, check_size
from .per_file import once_per_file

# fixed, so that the same pixels give the same bytes (by default the present time is written)
FIXED_DATE = "2000:01:01 00:00:00"
JPEG_QUALITY = 88  # of pictures in pages: no blocks are visible at the size of the picture
ROWS = 256  # read at a time: whole chunks of every EXR compression
MAX_CHANNELS = 256

# OpenImageIO's other EXR reader prints errors of a file on standard error
oiio.attribute("openexr:core", 1)


@dataclass(frozen=True)
class OpenImage:
    """An open image whose header has been read and checked."""

    path: Path
    container: Container
    file: oiio.ImageInput

    def colour(self) -> tuple[int, list[int]]:
        """(part, channel indices of R, G, B); a grey channel is repeated. Raises InputError."""
        try:
            return self._colour()
        except UnicodeDecodeError as error:
            raise InputError(
                "has channel names that are not text; the file is damaged", file=self.path
            ) from error

    def _colour(self) -> tuple[int, list[int]]:
        listed: list[str] = []
        part = 0
        while (spec := self.file.spec(part)).nchannels > 0:
            names = [name.upper() for name in spec.channelnames]
            if {"R", "G", "B"} <= set(names):
                return part, [names.index(c) for c in "RGB"]
            if len(names) <= 2 and names[0] in ("Y", "R", "L", "V", "I"):
                return part, [0, 0, 0]
            listed += spec.channelnames
            part += 1
        raise InputError(
            f"has the channels {', '.join(listed[:20])}; expected R, G and B, or a grey Y",
            file=self.path,
        )

    def blocks(self, part: int, channels: list[int]) -> Iterator[tuple[int, NDArray]]:
        """(first row, (rows, w, 1 or 3) pixels as stored), from top to bottom.

        One channel for a grey image. Raises InputError where the file ends or is damaged.
        """
        spec = self.file.spec(part)
        check_size(self.path, spec.width, spec.height)
        tile = spec.tile_height if spec.tile_width else 1
        if spec.nchannels > MAX_CHANNELS or spec.tile_width * spec.tile_height > 1 << 26:
            raise InputError(
                "has too many channels or too large tiles; expected an RGB or grey photo",
                file=self.path,
            )
        first, last = min(channels), max(channels) + 1
        wanted = [0] if last - first == 1 else [c - first for c in channels]
        step = -(-ROWS // tile) * tile
        for top in range(0, spec.height, step):
            end = min(top + step, spec.height)
            y0, y1 = spec.y + top, spec.y + end
            span = (first, last, oiio.UNKNOWN)
            if spec.tile_width:
                x0, x1 = spec.x, spec.x + spec.width
                block = self.file.read_tiles(part, 0, x0, x1, y0, y1, 0, 1, *span)
            else:
                block = self.file.read_scanlines(part, 0, y0, y1, 0, *span)
            if block is None:
                raise InputError(f"is truncated or damaged ({_reason(self.file)})", file=self.path)
            block = block.reshape(end - top, spec.width, last - first)
            yield top, block if wanted == list(range(last - first)) else block[:, :, wanted]


@contextmanager
def open_image(path: Path, pixels: bool = True) -> Iterator[OpenImage]:
    """Open an image with OpenImageIO. pixels: False to read only the header; the rest of the file
    is then not checked. Raises InputError."""
    container = check_container(path) if pixels else check_header(path)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)  # by default colours are multiplied by alpha
    file = oiio.ImageInput.open(str(path), hints)
    if file is None:
        raise InputError(f"is not a readable image ({_reason(oiio)})", file=path)
    try:
        spec = file.spec()
        whole = (spec.x, spec.y, spec.width, spec.height)
        if whole != (spec.full_x, spec.full_y, spec.full_width, spec.full_height):
            raise InputError(
                "is a cropped image (its data window differs from its display window); expected a "
                "full image: export it without cropping",
                file=path,
            )
        check_size(path, spec.width, spec.height)
        if spec.depth > 1 or spec.deep:
            raise InputError("contains a volume or deep pixels; expected a flat image", file=path)
        yield OpenImage(path, container, file)
    finally:
        _reason(file)  # clears errors, which would otherwise be printed when the program ends
        file.close()


def read_encoded(path: Path) -> NDArray[np.float32]:
    """(h, w, 3) pixels as the file encodes them (0..1 for integer formats). Raises InputError.

    The channels R, G, B are read by name, from the part of the file that has them. A grey image
    (Y) is repeated into three channels. Other channels (alpha, depth …) are ignored.
    """
    with open_image(path) as image:
        part, channels = image.colour()
        spec = image.file.spec(part)
        out = np.empty((spec.height, spec.width, 3), np.float32)
        for top, block in image.blocks(part, channels):
            rows = out[top : top + len(block)]
            if block.dtype.kind == "u":
                np.multiply(block, np.float32(1 / np.iinfo(block.dtype).max), out=rows)
            else:
                rows[:] = block
        return out


def read_mask(path: Path) -> NDArray[np.bool_]:
    """(h, w) where the mask is white (above one half) and not transparent. Raises InputError."""
    with open_image(path) as image:
        spec = image.file.spec()
        if spec.nchannels > MAX_CHANNELS:
            raise InputError(
                f"has too many channels for a mask; expected at most {MAX_CHANNELS}", file=path
            )
        alpha = spec.alpha_channel
        colours = [c for c in range(spec.nchannels) if c != alpha][:3]
        white = np.ones((spec.height, spec.width), bool)
        for top, block in image.blocks(0, list(range(spec.nchannels))):
            rows = white[top : top + len(block)]
            half = np.iinfo(block.dtype).max / 2 if block.dtype.kind == "u" else 0.5
            if colours:
                rows &= block[:, :, colours].max(axis=2) > half
            if alpha >= 0:
                rows &= block[:, :, alpha] > half
        return white


@once_per_file
def image_size(path: Path) -> tuple[int, int]:
    """(width, height) of an image as stored, including camera RAW. Raises InputError.

    Reads only the header, and caches the result until the file changes. A file with truncated
    pixels still has a size; the error is raised where its pixels are read.
    """
    if path.suffix.lower() in RAW:
        return raw.raw_size(path)
    with open_image(path, pixels=False) as image:
        spec = image.file.spec()
        return spec.width, spec.height


def attributes(path: Path) -> dict[str, object]:
    """{name: value} of the attributes in an image's header. Raises InputError."""
    with open_image(path, pixels=False) as image:
        found: dict[str, object] = {}
        for entry in image.file.spec().extra_attribs:
            with suppress(UnicodeDecodeError):
                found[entry.name] = entry.value
        return found


def write_exr(
    path: Path,
    pixels: NDArray[np.floating],
    half: bool = False,
    channels: Sequence[str] = (),
    description: str = "",
) -> None:
    """Write (h, w, c) pixels, row 0 on top: linear RGB or the named channels. The file is written
    atomically. half: 16-bit instead of 32-bit floats. Raises PatinaError."""
    kind = "half" if half else "float"
    with atomic_path(path, ".part.exr") as partial:
        _write(partial, np.asarray(pixels, np.float32), kind, channels, description)


def write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write (h, w), (h, w, 3) or (h, w, 4) 8-bit display-encoded pixels. Raises PatinaError."""
    _write(path, pixels, "uint8")


def write_jpeg(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write (h, w, 3) 8-bit display-encoded pixels with JPEG_QUALITY. Raises PatinaError."""
    _write(path, pixels, "uint8")


def _reason(source: Any) -> str:
    """The error message of OpenImageIO or one of its files, in one line; clears it."""
    try:
        found = " ".join(str(source.geterror()).split())
    except UnicodeDecodeError:  # the message quotes the damaged bytes
        found = "its header is damaged"
    return found[:200] or "no reason given"


def _write(
    path: Path,
    pixels: NDArray,
    kind: str,
    channels: Sequence[str] = (),
    description: str = "",
) -> None:
    if path.is_symlink():  # a downloaded folder may contain one that points anywhere
        raise PatinaError(
            f"{path}: is a symbolic link; images are not written through links: remove it"
        )
    data = np.ascontiguousarray(np.atleast_3d(pixels))
    height, width, count = data.shape
    spec = oiio.ImageSpec(width, height, count, kind)
    if channels:
        spec.channelnames = tuple(channels)
    if description:
        spec.attribute("ImageDescription", description)
    if path.suffix == ".exr":
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", FIXED_DATE)
    if path.suffix == ".jpg":
        spec.attribute("compression", f"jpeg:{JPEG_QUALITY}")
    output = oiio.ImageOutput.create(str(path))
    if output is None:
        raise PatinaError(f"{path}: cannot write images of this kind ({oiio.geterror()})")
    if not output.open(str(path), spec) or not output.write_image(data):
        raise PatinaError(f"{path}: cannot be written ({output.geterror()})")
    output.close()
