"""Read and write images with OpenImageIO.

Not with the OpenEXR wheel: inside Blender its symbols are replaced by Blender's own OpenEXR
library, and writing crashes.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from ..errors import InputError, PatinaError

LINEAR = {".exr"}
FIXED_DATE = "2000:01:01 00:00:00"  # else the clock is written: same pixels, other bytes


def read_radiance(path: Path) -> NDArray[np.float32]:
    """(h, w, 3) linear radiance of an EXR, in the photo's own units. Raises InputError.

    A grey image is repeated into three channels; alpha is left out.
    """
    if path.suffix.lower() not in LINEAR:
        raise InputError(
            f"photo format {path.suffix!r} is not read; expected a linear .exr", file=path
        )
    return read_encoded(path)


def read_encoded(path: Path) -> NDArray[np.float32]:
    """(h, w, 3) pixels as the file encodes them (0..1 for integer formats), for showing only."""
    pixels = _read(path)
    if pixels.shape[2] < 3:
        pixels = np.repeat(pixels[:, :, :1], 3, axis=2)
    return np.ascontiguousarray(pixels[:, :, :3])


def read_mask(path: Path) -> NDArray[np.bool_]:
    """(h, w) where the mask is white (above one half). Raises InputError."""
    pixels = _read(path)
    return pixels[:, :, : min(3, pixels.shape[2])].mean(axis=2) > 0.5


def image_size(path: Path) -> tuple[int, int]:
    """(width, height) of an image, read from its header only. Raises InputError."""
    image = _open(path)
    spec = image.spec()
    image.close()
    return spec.width, spec.height


def write_exr(path: Path, pixels: NDArray[np.floating], half: bool = False) -> None:
    """Write (h, w, 3) linear RGB; the file appears whole or not at all."""
    partial = path.with_name(path.stem + ".part.exr")
    _write(partial, np.asarray(pixels, np.float32), "half" if half else "float")
    os.replace(partial, path)


def write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write (h, w), (h, w, 3) or (h, w, 4) 8-bit display pixels."""
    _write(path, pixels, "uint8")


def _open(path: Path) -> oiio.ImageInput:
    if not path.is_file():
        raise InputError("no such file", file=path)
    image = oiio.ImageInput.open(str(path))
    if image is None:
        raise InputError(f"not a readable image ({oiio.geterror()})", file=path)
    return image


def _read(path: Path) -> NDArray[np.float32]:
    image = _open(path)
    try:
        pixels = image.read_image(oiio.FLOAT)
        if pixels is None:
            raise InputError(f"not a whole image ({image.geterror()})", file=path)
    finally:
        image.close()
    return np.atleast_3d(np.asarray(pixels, np.float32))


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
