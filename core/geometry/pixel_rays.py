"""Ray directions of many pixels: the lens is evaluated on a coarse lattice and interpolated.

Inverting a lens's distortion takes an iteration for each pixel, which costs more than casting its
ray. Where a lens cannot be interpolated accurately, or where it has no direction at some lattice
point, it is evaluated at every pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from .lattice import Lattice

MAX_ERROR = 0.002  # maximum error, pixels


@dataclass(frozen=True)
class PixelRays:
    """lattice: (3, rows, columns) world directions of a camera; None where the lens must be
    evaluated at every pixel."""

    camera: Camera
    lattice: Lattice | None

    @classmethod
    def of(cls, camera: Camera) -> PixelRays:
        """Build the lattice and test its accuracy at random pixels."""
        if camera.orthographic:
            return cls(camera, None)
        pixel = float(camera.footprint(np.ones(1))[0])
        made = Lattice.of(camera.width, camera.height, camera.rays, MAX_ERROR * pixel)
        return cls(camera, made)

    def window(self, top: int, bottom: int, left: int, right: int) -> NDArray[np.float32]:
        """(3, n) unit directions, world frame, through the centres of the pixels of rows top …
        bottom − 1 and columns left … right − 1, row after row; NaN where the lens has none."""
        if self.lattice is None:
            rows, columns = np.mgrid[top:bottom, left:right]
            pixels = np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=1)
            return np.ascontiguousarray(self.camera.rays(pixels).T, np.float32)
        return self.lattice.window(top, bottom, left, right)
