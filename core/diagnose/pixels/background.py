"""How bright the background of a photo is, where nothing of the object can be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...geometry.cover import ROWS

MIN_SHARE = 0.01  # of the photo's pixels: a background of fewer says nothing
DARKEST = 10.0  # percentile of the background, which may show a table or a lit cloth
MAX_PIXELS = 200_000  # that are looked at


def background_radiance(
    radiance: NDArray[np.float32], columns: NDArray[np.integer]
) -> NDArray[np.float32]:
    """(3,) radiance of the darkest tenth of the background of a photo (h, w, 3); NaN where it shows
    none. columns: Cover.columns of its camera, which may show the mesh. Pixels that are exactly 0
    do not count: photos are cut out that way."""
    step = max(1, int(np.sqrt(radiance.shape[0] * radiance.shape[1] / MAX_PIXELS)))
    some = radiance[::step, ::step]
    first, last = np.repeat(columns, ROWS, axis=0)[: radiance.shape[0] : step].T[:, :, None]
    x = np.arange(0, radiance.shape[1], step)
    found = some[(x < first) | (x >= last)]
    found = found[found.any(axis=1)]
    if len(found) < MIN_SHARE * some.shape[0] * some.shape[1]:
        return np.full(3, np.nan, np.float32)
    return np.percentile(found, DARKEST, axis=0).astype(np.float32)
