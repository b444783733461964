"""Spots of a photo that are darker than predicted, as under an unknown shadow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...angles import half_difference
from ..forward.pixels import Pixels
from .image_cells import cell_numbers, separated_positions

Array = NDArray[np.floating]

DARKER = 0.3  # fraction of the predicted radiance that a dark pixel lacks
DIM = 0.02  # of the 90th percentile of predicted radiance; darker pixels are not compared
HIGHLIGHT = np.radians(12.0)  # θh within which pixels are ignored
EDGE_DISTANCE = 2.0  # pixels from the object's own shadow edges, whose position is less exact
APART_FROM, TOUCHING = 6.0, 0.5  # pixels from such an edge; fraction of a spot that may be nearer
NEIGHBOURS, MIN_DARK = 8, 6  # nearest pixels in the photo, itself included; so many of them dark
MIN_SPOT_PIXELS = 12  # pixels of a spot
ACROSS = 5  # cells along the photo's longer side that divide a spot: it may be of two shadows


def unexplained_shadows(
    pixels: Pixels, shown: Array, min_pixels: int = MIN_SPOT_PIXELS
) -> NDArray[np.intp]:
    """(n,) number of the spot that each pixel is in, −1 none. shown: (n, 3) predicted radiance;
    min_pixels: minimum number of pixels of a spot.

    A pixel belongs to a spot if nearly all pixels around it are too dark as well; single ones are
    noise, dust, or a fold that the mesh does not have. A spot along the object's own shadow is more
    likely that shadow, slightly larger than the mesh predicts. A displaced highlight is caused by
    errors of the normals.
    """
    level, seen = shown.sum(axis=1), pixels.observed.sum(axis=1)
    lit = (level > DIM * np.percentile(level, 90)) & (pixels.visible > 0) & pixels.usable
    theta_h = half_difference(pixels.normal, pixels.light, pixels.view).theta_h
    rows = np.flatnonzero(lit & (pixels.edge > EDGE_DISTANCE) & (theta_h > HIGHLIGHT))
    out = np.full(len(level), -1, np.intp)
    if len(rows) < NEIGHBOURS:
        return out
    dark = seen[rows] < (1 - DARKER) * level[rows]
    place = separated_positions(pixels.photo, pixels.x, pixels.y)[rows]
    near = cKDTree(place).query(place[dark], NEIGHBOURS)[1]
    core = np.flatnonzero(dark[near].sum(axis=1) >= MIN_DARK)
    if not len(core):
        return out
    one, other = np.repeat(np.flatnonzero(dark)[core], NEIGHBOURS), near[core].ravel()
    one, other = one[dark[other]], other[dark[other]]
    graph = coo_array((np.ones(len(one)), (one, other)), (len(rows), len(rows)))
    spot = connected_components(graph, directed=False)[1]
    inside = np.zeros(len(rows), bool)
    inside[one] = inside[other] = True
    near_edge = np.bincount(spot, inside & (pixels.edge[rows] < APART_FROM))
    count = np.bincount(spot, inside)
    kept = inside & (count[spot] >= min_pixels) & (near_edge[spot] < TOUCHING * count[spot])
    cell = cell_numbers(pixels.photo, pixels.x, pixels.y, ACROSS)[rows]
    part = np.stack([spot[kept], cell[kept]])
    out[rows[kept]] = np.unique(part, axis=1, return_inverse=True)[1].ravel()
    return out
