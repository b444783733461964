"""How bright the background of a photo is, where nothing of the object can be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...geometry.cover import ROWS
from .neighbourhood import Veil

MIN_SHARE = 0.01  # of the photo's pixels: a background of fewer says nothing
MAX_ZEROS = 0.5  # of the background's pixels: photos with more zeros were cut out
DARKEST = 10.0  # percentile of the background, which may show a table or a lit cloth
MAX_PIXELS = 200_000  # that are looked at


def dark_background(
    radiance: NDArray[np.float32], columns: NDArray[np.integer], veil: Veil
) -> NDArray[np.float32]:
    """(3, 3) radiance of the darkest tenth of the background of a photo (h, w, 3), the blurred
    photo there, and the mean of the photo; NaN where it shows no background. columns: Cover.columns
    of its camera, which may show the mesh. veil: of the photo. A photo of which most of the
    background is exactly 0 was cut out, and shows none."""
    step = max(1, int(np.sqrt(radiance.shape[0] * radiance.shape[1] / MAX_PIXELS)))
    some = radiance[::step, ::step]
    first, last = np.repeat(columns, ROWS, axis=0)[: radiance.shape[0] : step].T[:, :, None]
    x = np.arange(0, radiance.shape[1], step)
    row, column = np.nonzero((x < first) | (x >= last))
    found = some[row, column]
    few = len(row) < MIN_SHARE * some.shape[0] * some.shape[1]
    if few or found.any(axis=1).mean() < 1 - MAX_ZEROS:
        return np.full((3, 3), np.nan, np.float32)
    level = np.percentile(found, DARKEST, axis=0)
    dark = found.sum(axis=1) <= np.percentile(found.sum(axis=1), DARKEST)
    around = veil.at(step * row[dark], step * column[dark]).mean(axis=0)
    return np.concatenate([level[None], around]).astype(np.float32)
