"""Every photo cut into squares over what it shows of the object."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def cell_places(photo: NDArray, x: Array, y: Array, across: int) -> tuple[Array, Array]:
    """((n,), (n,)) columns and rows as numbers from 0 to ``across``, which is the longer side of
    what a photo shows. photo: (n,); x, y: (n,) any unit."""
    column, row = np.zeros(len(x)), np.zeros(len(x))
    for number in np.unique(photo):
        mine = np.flatnonzero(photo == number)
        low_x, low_y = float(x[mine].min()), float(y[mine].min())
        size = max(float(np.ptp(x[mine])), float(np.ptp(y[mine])), 1e-6) / across
        column[mine], row[mine] = (x[mine] - low_x) / size, (y[mine] - low_y) / size
    return column, row


def cell_numbers(photo: NDArray, x: Array, y: Array, across: int) -> NDArray[np.int32]:
    """(n,) a number for each photo's each square."""
    column, row = (
        np.minimum(v.astype(np.int32), across - 1) for v in cell_places(photo, x, y, across)
    )
    return np.asarray((photo.astype(np.int32) * across + row) * across + column, np.int32)
