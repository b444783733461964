"""The surface that photos really show, where they do not lie as the scan says: a mesh turns within
a few pixels by more than along a straight line, and other shadows end there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene
from ..geometry.view import cast_shadow
from .effect import Array, Setting
from .part_lit import part_lit
from .pixels import Pixels

BEFORE = 0.03  # of the object's size, from which rays look back; twice as far is another surface


@dataclass(frozen=True)
class MovedView:
    """Of a pose with numbers x (p,): more: (n, 3) the normal that pixels show, less the one that
    they should; visible: (n,) part of the light that arrives there; known: (n,) where rays met the
    surface that is looked for."""

    x: NDArray[np.float64]
    more: Array
    visible: Array
    known: NDArray[np.bool_]

    @classmethod
    def of(
        cls, setting: Setting, beside: Array, margin: Array, x: NDArray[np.float64]
    ) -> MovedView:
        """setting: with what its pixels' points and normals are more a pixel to the right and down.
        beside: (n, 3) about how far the point that is shown lies from the one that should be.
        margin: (n,) pixels from the edge of a shadow where a pixel may be lit in part."""
        pixels, rays, back = setting.pixels, setting.rays, BEFORE * setting.size
        view = pixels.view.astype(np.float64)
        start = pixels.point + beside + back * view
        hits = rays.first_hits(start, -view)
        assert hits.distance is not None
        met = (hits.face >= 0) & (hits.distance < 2 * back)
        normal = np.zeros_like(view)
        normal[met] = rays.normals(hits.select(met))
        met &= np.einsum("ij,ij->i", normal, view) > 0
        rows = np.flatnonzero(met)
        shown = replace(
            pixels.select(rows),
            point=start[rows] - hits.distance[rows, None] * view[rows],
            normal=normal[rows].astype(np.float32),
        )
        more = np.where(met[:, None], normal - pixels.normal, 0).astype(np.float32)
        visible = pixels.visible.astype(np.float32)
        visible[rows] = _lit(rays, shown, margin[rows])
        return cls(x, more, visible, met)


def _lit(rays: RayScene, shown: Pixels, margin: Array) -> Array:
    """(n,) part of the light that arrives at what is shown; edge: of a shadow, where it should
    be."""
    facing = np.einsum("ij,ij->i", shown.normal, shown.light) > 0
    visible = np.ones(len(shown), np.float32)
    rows = np.flatnonzero(facing)
    visible[rows] = ~cast_shadow(
        rays, shown.point[rows], shown.normal[rows], shown.light[rows], None
    )
    rows = np.flatnonzero(shown.edge < margin)
    some = shown.select(rows)
    visible[rows] = part_lit(rays, some, some.light)
    return visible
