"""Read and write images with OpenImageIO.

Not with the OpenEXR wheel: inside Blender its symbols are replaced by Blender's own OpenEXR
library, and writing crashes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from ..errors import InputError, PatinaError
from .png_check import check_png

LINEAR = {".exr"}
FIXED_DATE = "2000:01:01 00:00:00"  # else the clock is written: same pixels, other bytes


def read_radiance(path: Path) -> NDArray[np.float32]:
    """(h, w, 3) linear radiance of an EXR, in the photo's own units. Raises InputError.

    The channels R, G, B are read by their names, in whichever part of the file holds them; a grey
    image (Y) is repeated into three channels; others (alpha, depth …) are left out.
    """
    if path.suffix.lower() not in LINEAR:
        raise InputError(
            f"photo format {path.suffix!r} is not read; expected a linear .exr", file=path
        )
    return read_encoded(path)


def read_encoded(path: Path) -> NDArray[np.float32]:
    """(h, w, 3) pixels as the file encodes them (0..1 for integer formats)."""
    with _open(path) as image:
        part, channels = _colour(image, path)
        pixels = _read(image, path, part)
    return np.ascontiguousarray(pixels[:, :, channels])


def read_mask(path: Path) -> NDArray[np.bool_]:
    """(h, w) where the mask is white (above one half) and not transparent. Raises InputError."""
    with _open(path) as image:
        spec = image.spec()
        alpha = spec.alpha_channel
        pixels = _read(image, path, 0)
    colours = [c for c in range(pixels.shape[2]) if c != alpha][:3]
    white = pixels[:, :, colours].max(axis=2) if colours else np.ones(pixels.shape[:2])
    return (white > 0.5) & (alpha < 0 or pixels[:, :, alpha] > 0.5)


def image_size(path: Path) -> tuple[int, int]:
    """(width, height) of an image, read from its header only. Raises InputError."""
    with _open(path) as image:
        spec = image.spec()
        return spec.width, spec.height


def write_exr(path: Path, pixels: NDArray[np.floating], half: bool = False) -> None:
    """Write (h, w, 3) linear RGB; the file appears whole or not at all."""
    partial = path.with_name(path.stem + ".part.exr")
    _write(partial, np.asarray(pixels, np.float32), "half" if half else "float")
    os.replace(partial, path)


def write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write (h, w), (h, w, 3) or (h, w, 4) 8-bit display pixels."""
    _write(path, pixels, "uint8")


@contextmanager
def _open(path: Path) -> Iterator[oiio.ImageInput]:
    if not path.is_file():
        raise InputError("is not a file" if path.exists() else "no such file", file=path)
    if path.suffix.lower() == ".png":
        check_png(path)  # its reader would print on its own
    image = oiio.ImageInput.open(str(path))
    if image is None:
        raise InputError(f"not a readable image ({oiio.geterror()})", file=path)
    try:
        kind = image.format_name()
        if path.suffix.lower() == ".exr" and kind != "openexr":
            raise InputError(f"is named .exr, but holds a {kind} image", file=path)
        spec = image.spec()
        whole = (spec.x, spec.y, spec.width, spec.height)
        if whole != (spec.full_x, spec.full_y, spec.full_width, spec.full_height):
            raise InputError("holds a cropped image (data and display window differ)", file=path)
        yield image
    finally:
        image.close()


def _read(image: oiio.ImageInput, path: Path, part: int) -> NDArray[np.float32]:
    pixels = image.read_image(part, 0, 0, image.spec(part).nchannels, oiio.FLOAT)
    if pixels is None:
        raise InputError(f"not a whole image ({image.geterror()})", file=path)
    return np.atleast_3d(np.asarray(pixels, np.float32))


def _colour(image: oiio.ImageInput, path: Path) -> tuple[int, list[int]]:
    """(part, channels) that hold R, G, B, or a grey image three times."""
    listed: list[str] = []
    part = 0
    while (spec := image.spec(part)).nchannels > 0:
        names = [name.upper() for name in spec.channelnames]
        if {"R", "G", "B"} <= set(names):
            return part, [names.index(c) for c in "RGB"]
        if len(names) <= 2 and names[0] in ("Y", "R", "L", "V"):
            return part, [0, 0, 0]
        listed += spec.channelnames
        part += 1
    raise InputError(
        f"has no channels R, G and B (nor a grey Y); it has {', '.join(listed)}", file=path
    )


def _write(path: Path, pixels: NDArray, kind: str) -> None:
    data = np.ascontiguousarray(np.atleast_3d(pixels))
    height, width, channels = data.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    if path.suffix == ".exr":
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", FIXED_DATE)
    output = oiio.ImageOutput.create(str(path))
    if output is None:
        raise PatinaError(f"{path}: cannot write images of this kind ({oiio.geterror()})")
    if not output.open(str(path), spec) or not output.write_image(data):
        raise PatinaError(f"{path}: cannot be written ({output.geterror()})")
    output.close()
