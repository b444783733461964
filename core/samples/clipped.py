"""Samples of clipped pixels: in a clipped channel, the radiance is at least the one recorded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..geometry import SurfaceView
from ..noise import PixelNoise
from .table import SampleTable
from .take import Lighting, sample_rows

WHITE_MARGIN = 0.99  # of the least radiance of a clipped channel: decoded values are rounded


@dataclass(frozen=True)
class White:
    """Where a photo is clipped. level: the radiance from which a channel counts as clipped,
    infinite where no pixel is clipped. mixed: whether the channels were mixed by a colour matrix
    after they were clipped: then only pixels that are clipped in all channels give lower limits."""

    level: float
    mixed: bool = False

    @classmethod
    def of(
        cls, radiance: NDArray[np.float32], usable: NDArray[np.bool_], mixed: bool = False
    ) -> White:
        """radiance: (h, w, 3), 0 where nothing is known; usable: (h, w) not clipped."""
        brightest = radiance[~usable].max(axis=1, initial=0.0)
        level = WHITE_MARGIN * float(brightest[brightest > 0].min(initial=np.inf))
        return cls(level, mixed)


def clipped_rows(
    view: SurfaceView,
    lighting: Lighting,
    radiance: NDArray[np.float32],
    rows: NDArray[np.intp],
    photo: int,
    white: White,
    noise: PixelNoise | None = None,
) -> SampleTable:
    """The samples of some rows of a view, all of them clipped pixels. ``response`` is 0 in the
    channels that are clipped: their radiance is a lower limit.

    radiance: (h, w, 3) of the whole photo, 0 where nothing is known (clipped in all exposures of a
    bracket): these pixels are left out. photo, noise: as in take.sample_photo.
    """
    limited = radiance.reshape(-1, 3).take(view.pixel.take(rows), axis=0) >= white.level
    rows = rows[limited.all(axis=1) if white.mixed else limited.any(axis=1)]
    if not len(rows):
        return SampleTable.empty()
    table = sample_rows(view, lighting, radiance, rows, photo, noise)
    return replace(table, response=(table.radiance < white.level).astype(np.float32))
