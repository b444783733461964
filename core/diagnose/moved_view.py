"""The surface that photos really show, where they do not lie as the scan says: a mesh turns within
a few pixels by more than along a straight line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .effect import Array, Setting

BEFORE = 0.03  # of the object's size, from which rays look back; twice as far is another surface


@dataclass(frozen=True)
class MovedView:
    """Of a pose with numbers x (p,): more: (n, 3) the normal that pixels show, less the one that
    they should; known: (n,) where rays met the surface that is looked for."""

    x: NDArray[np.float64]
    more: Array
    known: NDArray[np.bool_]

    @classmethod
    def of(cls, setting: Setting, beside: Array, x: NDArray[np.float64]) -> MovedView:
        """beside: (n, 3) about how far the point that is shown lies from the one that should be."""
        pixels, back = setting.pixels, BEFORE * setting.size
        view = pixels.view.astype(np.float64)
        hits = setting.rays.first_hits(pixels.point + beside + back * view, -view)
        assert hits.distance is not None
        met = (hits.face >= 0) & (hits.distance < 2 * back)
        normal = np.zeros_like(view)
        normal[met] = setting.rays.normals(hits.select(met))
        met &= np.einsum("ij,ij->i", normal, view) > 0
        more = np.where(met[:, None], normal - pixels.normal, 0).astype(np.float32)
        return cls(x, more, met)
