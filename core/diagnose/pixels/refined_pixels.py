"""Dark spots in all that a photo shows: chosen pixels are too far apart to tell of small ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...samples.reservoir import sample_hash
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.pixels import Pixels
from ..forward.shading_state import ShadingState
from .unexplained_shadows import FEWEST, unexplained_shadows

MOST = 250_000  # pixels of a photo that are looked through
PART = 0.003  # of what the photo shows: a smaller spot may be a fold that the mesh does not have
RING = 3.0  # steps of the grid about a spot, which tell where it ends


def grid_step(width: int, height: int) -> int:
    """Pixels between those of a photo that are looked through."""
    return max(1, int(np.ceil(np.sqrt(width * height / MOST))))


def on_grid(pixel: NDArray[np.integer], width: int, step: int) -> NDArray[np.intp]:
    """Which of flat places (n,) are looked through."""
    row, column = np.divmod(pixel, width)
    return np.flatnonzero((row % step == 0) & (column % step == 0))


def pixels_near_unexplained_shadows(
    pixels: Pixels, brdfs: MaterialBRDFs, width: int, step: int, most: int
) -> NDArray[np.intp]:
    """At most so many of the pixels of one photo: those of dark spots and about them. step: of
    their grid; irradiance as the BRDFs want it."""
    shown = brdfs.reflected(ShadingState.of(pixels))
    spot = unexplained_shadows(pixels, shown, max(FEWEST, int(PART * len(pixels))))
    if (spot < 0).all():
        return np.zeros(0, np.intp)
    place = np.stack(np.divmod(pixels.pixel, width), axis=1)
    tree = cKDTree(place[spot >= 0])
    far = tree.query(place, distance_upper_bound=(RING + 0.1) * step)[0]
    about = np.flatnonzero(np.isfinite(far))
    number = sample_hash(pixels.photo[about], pixels.pixel[about])
    return np.asarray(np.sort(about[np.argsort(number)[:most]]))
