"""Arrays as EXR pictures with named channels, written and closed before they get their name."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from ..errors import PatinaError

DATE = "2000:01:01 00:00:00"  # the same input gives the same bytes


def write_float_exr(
    path: Path, pixels: NDArray[np.floating], channels: Sequence[str], description: str
) -> None:
    """Write (h, w, c) as 32-bit floats, ZIP compressed, row 0 on top. Raises PatinaError."""
    data = np.ascontiguousarray(pixels, np.float32)
    height, width, count = data.shape
    spec = oiio.ImageSpec(width, height, count, "float")
    spec.channelnames = tuple(channels)
    spec.attribute("compression", "zip")
    spec.attribute("DateTime", DATE)
    spec.attribute("ImageDescription", description)
    partial = path.with_name(path.stem + ".part.exr")
    output = oiio.ImageOutput.create(str(partial))
    if output is None:
        raise PatinaError(f"{path}: cannot write EXR ({oiio.geterror()})")
    if not output.open(str(partial), spec) or not output.write_image(data):
        raise PatinaError(f"{path}: cannot be written ({output.geterror()})")
    output.close()
    os.replace(partial, path)
