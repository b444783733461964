"""Square cells over the image of the object in every photo."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

SEPARATION = 1e3  # between two photos along a third axis, in the unit of x and y


def centred_coordinates(
    pixel: NDArray[np.integer], width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """((n,), (n,)) x and y relative to the centre of a photo, 1 at half the diagonal. pixel: (n,)
    flat indices."""
    row, column = np.divmod(pixel, width)
    half = 0.5 * np.hypot(width, height)
    x, y = (column + 0.5 - width / 2) / half, (row + 0.5 - height / 2) / half
    return x.astype(np.float32), y.astype(np.float32)


def separated_positions(photo: NDArray, x: Array, y: Array) -> NDArray[np.float64]:
    """(n, 3) positions, such that pixels of different photos are far apart. photo: (n,); x, y:
    (n,)."""
    return np.stack([x, y, SEPARATION * photo.astype(np.float64)], axis=1)


def cell_coordinates(photo: NDArray, x: Array, y: Array, across: int) -> tuple[Array, Array]:
    """((n,), (n,)) column and row of each pixel in cells, 0 to ``across`` along the longer side of
    the image of the object. photo: (n,); x, y: (n,) in any unit."""
    column, row = np.zeros(len(x)), np.zeros(len(x))
    for number in np.unique(photo):
        mine = np.flatnonzero(photo == number)
        low_x, low_y = float(x[mine].min()), float(y[mine].min())
        size = max(float(np.ptp(x[mine])), float(np.ptp(y[mine])), 1e-6) / across
        column[mine], row[mine] = (x[mine] - low_x) / size, (y[mine] - low_y) / size
    return column, row


def cell_numbers(photo: NDArray, x: Array, y: Array, across: int) -> NDArray[np.int32]:
    """(n,) number of the cell of each pixel, unique over all photos."""
    column, row = (
        np.minimum(v.astype(np.int32), across - 1) for v in cell_coordinates(photo, x, y, across)
    )
    return np.asarray((photo.astype(np.int32) * across + row) * across + column, np.int32)
