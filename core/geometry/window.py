"""Pieces of a photo that are looked at one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from .cover import ROWS

PIXELS = 1 << 19  # of a window: some MB an array, and what its halo costs twice is little


class Window(NamedTuple):
    """Rows top … bottom − 1 and columns left … right − 1 are looked at; rows first … last − 1 are
    wanted: the others are the halo, which the margins of those need to know."""

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
    """All of a photo."""
    return Window(0, camera.height, 0, camera.width, 0, camera.height)


def bands(
    camera: Camera,
    halo: int,
    columns: NDArray[np.int32] | None = None,
    pixels: int = PIXELS,
) -> Iterator[Window]:
    """The rows of a photo in bands of about so many ``pixels`` (never less than four halos high),
    each with ``halo`` rows more on either side, as far as the photo goes. columns: what
    Cover.columns says; bands where there is nothing are left out."""
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
