"""Ray directions of many pixels: the lens is evaluated on a coarse lattice and interpolated.

Inverting a lens's distortion takes an iteration for each pixel, which costs more than casting its
ray. Between lattice points the direction is a smooth function, and cubic interpolation from four
points is far more accurate than a pixel. Where a test shows that a lens cannot be interpolated so
well, or where it has no direction at some lattice point, it is evaluated at every pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera

Array = NDArray[np.float64]
STEP = 16  # pixels between lattice points
PROBES = 12, 40  # rows, and pixels in each row, to test the lattice
MAX_ERROR = 0.002  # maximum error, pixels
MIN_LATTICE_POINTS = 8  # lattice points per side; smaller photos are evaluated at every pixel


@dataclass(frozen=True)
class PixelRays:
    """lattice: (3, rows, columns) float64 world directions at pixels 0, 16, 32, … of a camera; None
    where the lens must be evaluated at every pixel."""

    camera: Camera
    lattice: Array | None

    @classmethod
    def of(cls, camera: Camera) -> PixelRays:
        """Build the lattice and test its accuracy at random pixels."""
        lattice = _lattice(camera)
        if lattice is None:
            return cls(camera, None)
        made = cls(camera, lattice)
        rng = np.random.default_rng(0)
        test_rows = rng.integers(0, camera.height, PROBES[0])
        column = rng.integers(0, camera.width, (PROBES[0], PROBES[1]))
        pixels = np.stack([column, np.broadcast_to(test_rows[:, None], column.shape)], axis=-1)
        exact = camera.rays(pixels.reshape(-1, 2) + 0.5)
        interpolated = np.concatenate(
            [
                made.window(row, row + 1, 0, camera.width)[:, some].T
                for row, some in zip(test_rows.tolist(), column, strict=True)
            ]
        )
        error = np.linalg.norm(interpolated - exact, axis=1)
        pixel = float(camera.footprint(np.ones(1))[0])
        return made if (error < MAX_ERROR * pixel).all() else cls(camera, None)

    def window(self, top: int, bottom: int, left: int, right: int) -> NDArray[np.float32]:
        """(3, n) unit directions, world frame, through the centres of the pixels of rows top …
        bottom − 1 and columns left … right − 1, row after row; NaN where the lens has none."""
        if self.lattice is None:
            rows, columns = np.mgrid[top:bottom, left:right]
            pixels = np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=1)
            return np.ascontiguousarray(self.camera.rays(pixels).T, np.float32)
        out = np.empty((3, bottom - top, right - left), np.float32)
        down, weight_down = _stencil(top, bottom, self.lattice.shape[1])
        along, weight_along = _stencil(left, right, self.lattice.shape[2])
        weight_along = weight_along.astype(np.float32)
        for axis in range(3):
            lines = sum(
                weight_down[j][:, None] * self.lattice[axis].take(down + j, axis=0)
                for j in range(4)
            )
            lines = np.asarray(lines, np.float32)
            part = out[axis]
            np.multiply(lines.take(along, axis=1), weight_along[0], out=part)
            for j in range(1, 4):
                part += lines.take(along + j, axis=1) * weight_along[j]
        return out.reshape(3, -1)


def _lattice(camera: Camera) -> Array | None:
    """(3, rows, columns) directions; None for small photos, orthographic cameras and lenses with
    undefined directions."""
    rows, columns = (-(-(size - 1) // STEP) + 1 for size in (camera.height, camera.width))
    if camera.orthographic or min(rows, columns) < MIN_LATTICE_POINTS:
        return None
    y, x = np.mgrid[0:rows, 0:columns] * STEP + 0.5
    found = camera.rays(np.stack([x.ravel(), y.ravel()], axis=1))
    if not np.isfinite(found).all():
        return None
    return np.ascontiguousarray(found.T).reshape(3, rows, columns)


def _stencil(begin: int, end: int, count: int) -> tuple[NDArray[np.intp], Array]:
    """((n,) first of the four lattice points, (4, n) Lagrange weights) of pixels begin … end."""
    place = np.arange(begin, end) / STEP
    first = np.clip(np.floor(place).astype(np.intp) - 1, 0, count - 4)
    t = place - first
    return first, np.stack(
        [
            -(t - 1) * (t - 2) * (t - 3) / 6,
            t * (t - 2) * (t - 3) / 2,
            -t * (t - 1) * (t - 3) / 2,
            t * (t - 1) * (t - 2) / 6,
        ]
    )
