"""Convert linear light back to the encoded pixel values of a photo's file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from .container import RAW
from .declared import LINEAR, declared
from .image import open_image
from .transfer import Transfer

KNOTS = (1 << 14) + 1  # sample points of the inverse curve: an error of a quarter 16-bit code


@dataclass(frozen=True)
class Encoding:
    """The encoding of one photo. transfer: from encoded values to linear light; bounded: True for
    integer formats, whose values are limited to 0..1."""

    transfer: Transfer
    bounded: bool

    @classmethod
    def of_file(cls, file: Path, curve: Transfer) -> Encoding:
        """The encoding of a photo that is read with ``curve``; "auto" is the curve that the file
        declares. Reads only the header. Raises InputError."""
        if file.suffix.lower() in RAW:
            return cls(curve if curve.curves else LINEAR, False)
        with open_image(file) as image:
            part, _ = image.colour()
            kind = image.file.spec(part).format.basetype
            stated = curve if curve.curves else declared(image, part).transfer
        return cls(stated, kind not in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE))

    def encode(self, linear: NDArray[np.floating]) -> NDArray[np.float32]:
        """(…, 3) encoded values of linear light (…, 3), Rec.709 primaries; NaN stays NaN.

        Values are clipped to 0..1 for bounded encodings and for all curves except linear.
        """
        out = np.empty(linear.shape, np.float32)
        if self.transfer.is_linear:
            out[...] = np.clip(linear, 0.0, 1.0) if self.bounded else linear
            return out
        encoded = np.linspace(0.0, 1.0, KNOTS)
        for channel, curve in enumerate(self.transfer.curves):
            out[..., channel] = np.interp(linear[..., channel], curve(encoded), encoded)
        return out
