"""The surface that photos really show, where they do not lie as the scan says: a mesh turns within
a few pixels by more than along a straight line, and other shadows end there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....geometry.view import cast_shadow
from ...forward.diagnosis_context import DiagnosisContext
from ...forward.partial_visibility import partial_visibility
from ...forward.pixels import Pixels
from .effect import Array

BEFORE = 0.03  # of the object's size, from which rays look back; twice as far is another surface
ABOUT = 2.0 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])  # pixels right and down


@dataclass(frozen=True)
class DisplacedView:
    """Of a pose with numbers x (p,): more: (n, 3) the normal that pixels show, less the one that
    they should; visible: (n,) part of the light that arrives there; known: (n,) where rays met the
    surface that is looked for; ends: (n,) where within two pixels of it, it or the light ends."""

    x: NDArray[np.float64]
    more: Array
    visible: Array
    known: NDArray[np.bool_]
    ends: NDArray[np.bool_]

    @classmethod
    def of(cls, context: DiagnosisContext, beside: Array, x: NDArray[np.float64]) -> DisplacedView:
        """context: with what its pixels' points and normals are more a pixel to the right and down.
        beside: (n, 3) about how far the point that is shown lies from the one that should be."""
        pixels, step = context.pixels, context.pixels.step
        met, shown = _shown(context, beside)
        more, visible = np.zeros_like(pixels.normal), pixels.visible.astype(np.float32)
        more[met] = shown.normal - pixels.normal[met]
        lit = _lit(context, met, shown)
        ends = np.zeros(len(pixels), bool)
        for right, down in ABOUT:
            aside = _shown(context, beside + right * step[:, 0] + down * step[:, 1])
            ends |= _lit(context, *aside) != lit
        visible[met] = np.where(lit[met], 1, _turned_away(shown))
        rows = np.flatnonzero((ends & met)[met])
        some = shown.select(rows)
        visible[np.flatnonzero(met)[rows]] = partial_visibility(context.rays, some, some.light)
        return cls(x, more, visible, met, ends)

    @property
    def dark_where_it_ends(self) -> DisplacedView:
        """The same without light where nobody knows what a pixel shows."""
        sure = self.known & ~self.ends
        return replace(self, visible=np.where(sure, self.visible, np.float32(0)))


def _shown(context: DiagnosisContext, beside: Array) -> tuple[NDArray[np.bool_], Pixels]:
    """((n,) whether rays meet the surface so far beside where pixels should look, those pixels with
    the point and the normal that they meet)."""
    pixels, back = context.pixels, BEFORE * context.size
    view = pixels.view.astype(np.float64)
    start = pixels.point + beside + back * view
    hits = context.rays.first_hits(start, -view)
    assert hits.distance is not None
    met = (hits.face >= 0) & (hits.distance < 2 * back)
    normal = np.zeros_like(view)
    normal[met] = context.rays.normals(hits.select(met))
    met &= np.einsum("ij,ij->i", normal, view) > 0
    point = start - np.where(met, hits.distance, 0)[:, None] * view
    shown = replace(pixels.select(met), point=point[met], normal=normal[met].astype(np.float32))
    return met, shown


def _lit(context: DiagnosisContext, met: NDArray[np.bool_], shown: Pixels) -> NDArray[np.bool_]:
    """(n,) whether light arrives at what is shown; not where nothing is."""
    facing = ~_turned_away(shown)
    rows = np.flatnonzero(facing)
    facing[rows] = ~cast_shadow(
        context.rays, shown.point[rows], shown.normal[rows], shown.light[rows], None
    )
    lit = np.zeros(len(met), bool)
    lit[met] = facing
    return lit


def _turned_away(shown: Pixels) -> NDArray[np.bool_]:
    return np.asarray(np.einsum("ij,ij->i", shown.normal, shown.light) <= 0)
