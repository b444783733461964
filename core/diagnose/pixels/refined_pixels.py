"""Dark spots on a dense grid of pixels: the selected pixels are too far apart for small spots."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...samples.reservoir import sample_hash
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.pixels import Pixels
from ..forward.shading_state import ShadingState
from .unexplained_shadows import MIN_SPOT_PIXELS, unexplained_shadows

MAX_GRID_PIXELS = 250_000  # of a photo
MIN_SPOT_FRACTION = 0.003  # of the grid; a smaller spot may be a fold that the mesh does not have
RING = 3.0  # grid steps around a spot that are included, so that its edge is known


def grid_step(width: int, height: int) -> int:
    """Spacing of the grid in a photo, pixels."""
    return max(1, int(np.ceil(np.sqrt(width * height / MAX_GRID_PIXELS))))


def on_grid(pixel: NDArray[np.integer], width: int, step: int) -> NDArray[np.intp]:
    """Indices of the pixels that lie on the grid. pixel: (n,) flat indices; step: of the grid."""
    row, column = np.divmod(pixel, width)
    return np.flatnonzero((row % step == 0) & (column % step == 0))


def pixels_near_unexplained_shadows(
    pixels: Pixels, brdfs: MaterialBRDFs, width: int, step: int, most: int
) -> NDArray[np.intp]:
    """Indices of at most ``most`` pixels of one photo in dark spots and around them. pixels: on a
    grid of this step, with irradiance in the unit of the BRDFs."""
    shown = brdfs.reflected(ShadingState.of(pixels))
    spot = unexplained_shadows(
        pixels, shown, max(MIN_SPOT_PIXELS, int(MIN_SPOT_FRACTION * len(pixels)))
    )
    if (spot < 0).all():
        return np.zeros(0, np.intp)
    place = np.stack(np.divmod(pixels.pixel, width), axis=1)
    tree = cKDTree(place[spot >= 0])
    far = tree.query(place, distance_upper_bound=(RING + 0.1) * step)[0]
    about = np.flatnonzero(np.isfinite(far))
    number = sample_hash(pixels.photo[about], pixels.pixel[about])
    return np.asarray(np.sort(about[np.argsort(number)[:most]]))
