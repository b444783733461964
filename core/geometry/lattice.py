"""A smooth function of the pixel, evaluated on a coarse lattice and interpolated.

Functions of a lens cost more than a ray or a look-up where they need an iteration for each pixel.
Between lattice points they are smooth, and cubic interpolation from four points is far more
accurate than a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 16  # pixels between lattice points
PROBES = 12, 40  # rows, and pixels in each row, to test the lattice
MIN_POINTS = 8  # lattice points per side; smaller photos are evaluated at every pixel


@dataclass(frozen=True)
class Lattice:
    """values: (k, rows, columns) of the function at pixels 0, 16, 32 … ."""

    values: Array

    @classmethod
    def of(
        cls, width: int, height: int, function: Callable[[Array], Array], max_error: float
    ) -> Lattice | None:
        """Evaluate ``function``, pixels (n, 2) → (n, k), and test the accuracy at random pixels.

        max_error: the largest distance of interpolated and true values. None where that is
        exceeded, the photo is small, or a value is not finite.
        """
        rows, columns = (-(-(size - 1) // STEP) + 1 for size in (height, width))
        if min(rows, columns) < MIN_POINTS:
            return None
        y, x = np.mgrid[0:rows, 0:columns] * STEP + 0.5
        found = function(np.stack([x.ravel(), y.ravel()], axis=1))
        if not np.isfinite(found).all():
            return None
        made = cls(np.ascontiguousarray(found.T).reshape(-1, rows, columns))
        rng = np.random.default_rng(0)
        test_rows = rng.integers(0, height, PROBES[0])
        column = rng.integers(0, width, (PROBES[0], PROBES[1]))
        pixels = np.stack([column, np.broadcast_to(test_rows[:, None], column.shape)], axis=-1)
        exact = function(pixels.reshape(-1, 2) + 0.5)
        interpolated = np.concatenate(
            [
                made.window(row, row + 1, 0, width)[:, some].T
                for row, some in zip(test_rows.tolist(), column, strict=True)
            ]
        )
        error = np.linalg.norm(interpolated - exact, axis=1)
        return made if (error < max_error).all() else None

    def window(self, top: int, bottom: int, left: int, right: int) -> NDArray[np.float32]:
        """(k, n) values at the centres of the pixels of rows top … bottom − 1 and columns left …
        right − 1, row after row."""
        out = np.empty((len(self.values), bottom - top, right - left), np.float32)
        down, weight_down = _stencil(top, bottom, self.values.shape[1])
        along, weight_along = _stencil(left, right, self.values.shape[2])
        weight_along = weight_along.astype(np.float32)
        for axis, values in enumerate(self.values):
            lines = sum(weight_down[j][:, None] * values.take(down + j, axis=0) for j in range(4))
            lines = np.asarray(lines, np.float32)
            part = out[axis]
            np.multiply(lines.take(along, axis=1), weight_along[0], out=part)
            for j in range(1, 4):
                part += lines.take(along + j, axis=1) * weight_along[j]
        return out.reshape(len(self.values), -1)


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
