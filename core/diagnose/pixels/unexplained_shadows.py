"""Spots of a photo that are darker than the model says: what a shadow would do."""

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

DARKER = 0.3  # of what is predicted, missed
DIM = 0.02  # of the photos' bright pixels: darker ones give no ratio
HIGHLIGHT = np.radians(12.0)  # θh, within which nothing is looked for
BESIDE = 2.0  # pixels from the edge of a shadow of the object's own, whose place is not so exact
APART_FROM, TOUCHING = 6.0, 0.5  # pixels from that edge; part of a spot that may lie nearer
AROUND, MOST = 8, 6  # pixels nearest in the photo, itself included; so many of them dark
FEWEST = 12  # pixels of a spot
ACROSS = 5  # squares along a photo's longer side that a spot is cut by: it may be of two shadows


def unexplained_shadows(pixels: Pixels, shown: Array, fewest: int = FEWEST) -> NDArray[np.intp]:
    """(n,) number of the spot that each pixel is in, −1 none. shown: (n, 3) prediction; fewest:
    pixels of a spot.

    A pixel belongs to a spot where nearly all pixels about it are too dark as well: single ones are
    noise, dust, or a fold that the mesh does not have. A spot that lies along the object's own
    shadow is more likely that shadow, a little larger than the mesh makes it; and a highlight that
    is not where it should be is the normals' doing.
    """
    level, seen = shown.sum(axis=1), pixels.observed.sum(axis=1)
    lit = (level > DIM * np.percentile(level, 90)) & (pixels.visible > 0) & pixels.usable
    theta_h = half_difference(pixels.normal, pixels.light, pixels.view).theta_h
    rows = np.flatnonzero(lit & (pixels.edge > BESIDE) & (theta_h > HIGHLIGHT))
    out = np.full(len(level), -1, np.intp)
    if len(rows) < AROUND:
        return out
    dark = seen[rows] < (1 - DARKER) * level[rows]
    place = separated_positions(pixels.photo, pixels.x, pixels.y)[rows]
    near = cKDTree(place).query(place[dark], AROUND)[1]
    core = np.flatnonzero(dark[near].sum(axis=1) >= MOST)
    if not len(core):
        return out
    one, other = np.repeat(np.flatnonzero(dark)[core], AROUND), near[core].ravel()
    one, other = one[dark[other]], other[dark[other]]
    graph = coo_array((np.ones(len(one)), (one, other)), (len(rows), len(rows)))
    spot = connected_components(graph, directed=False)[1]
    inside = np.zeros(len(rows), bool)
    inside[one] = inside[other] = True
    beside = np.bincount(spot, inside & (pixels.edge[rows] < APART_FROM))
    count = np.bincount(spot, inside)
    kept = inside & (count[spot] >= fewest) & (beside[spot] < TOUCHING * count[spot])
    cell = cell_numbers(pixels.photo, pixels.x, pixels.y, ACROSS)[rows]
    part = np.stack([spot[kept], cell[kept]])
    out[rows[kept]] = np.unique(part, axis=1, return_inverse=True)[1].ravel()
    return out
