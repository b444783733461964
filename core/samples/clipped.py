"""Samples of clipped pixels: in a clipped channel, the radiance is at least the one recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..geometry import SurfaceView
from .table import SampleTable
from .take import Lighting, sample_rows

WHITE_MARGIN = 0.99  # of the least radiance of a clipped channel: decoded values are rounded


def white_of_clipped(radiance: NDArray[np.float32], usable: NDArray[np.bool_]) -> float:
    """The radiance from which a channel of a photo counts as clipped, infinite where no pixel is.

    radiance: (h, w, 3), 0 where nothing is known; usable: (h, w) not clipped.
    """
    brightest = radiance[~usable].max(axis=1, initial=0.0)
    return WHITE_MARGIN * float(brightest[brightest > 0].min(initial=np.inf))


def clipped_rows(
    view: SurfaceView,
    lighting: Lighting,
    radiance: NDArray[np.float32],
    rows: NDArray[np.intp],
    photo: int,
    white: float,
) -> SampleTable:
    """The samples of some rows of a view, all of them clipped pixels. ``response`` is 0 in the
    channels that are clipped: their radiance is a lower limit.

    radiance: (h, w, 3) of the whole photo, 0 where nothing is known (clipped in all exposures of a
    bracket): these pixels are left out. white: of white_of_clipped.
    """
    brightest = radiance.reshape(-1, 3).take(view.pixel.take(rows), axis=0).max(axis=1, initial=0.0)
    rows = rows[brightest >= white]
    if not len(rows):
        return SampleTable.empty()
    table = sample_rows(view, lighting, radiance, rows, photo)
    return replace(table, response=(table.radiance < white).astype(np.float32))
