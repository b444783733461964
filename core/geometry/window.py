"""Windows of a photo that are processed one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from .cover import ROWS

WINDOW_PIXELS = 1 << 19  # of a window: some MB per array, and the halo is a small part of it


class Window(NamedTuple):
    """Rows top … bottom − 1 and columns left … right − 1 are processed. Rows first … last − 1 are
    wanted; the others are the halo that neighbourhood operations need."""

    top: int
    bottom: int
    left: int
    right: int
    first: int
    last: int

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.bottom - self.top, self.right - self.left


def whole(camera: Camera) -> Window:
    """The window of a whole photo."""
    return Window(0, camera.height, 0, camera.width, 0, camera.height)


def bands(
    camera: Camera,
    halo: int,
    columns: NDArray[np.int32] | None = None,
    pixels: int = WINDOW_PIXELS,
) -> Iterator[Window]:
    """Bands of rows of a photo with about ``pixels`` pixels each (at least four halos high), with
    ``halo`` more rows on either side within the photo. columns: the result of Cover.columns; bands
    without a column are omitted."""
    step = max(1, pixels // max(camera.width, 1), 4 * halo)
    for first in range(0, camera.height, step):
        last = min(first + step, camera.height)
        top, bottom = max(0, first - halo), min(camera.height, last + halo)
        left, right = 0, camera.width
        if columns is not None:
            part = columns[top // ROWS : (bottom - 1) // ROWS + 1]
            part = part[part[:, 0] < part[:, 1]]
            if not len(part):
                continue
            left, right = int(part[:, 0].min()), int(part[:, 1].max())
        yield Window(top, bottom, left, right, first, last)
