"""The surface that a photo shows under a corrected camera pose.

Within a few pixels the normals of a mesh do not change linearly, and other shadow edges appear."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....geometry.view import cast_shadow
from ...forward.diagnosis_context import DiagnosisContext
from ...forward.partial_visibility import partial_visibility
from ...forward.pixels import Pixels
from .effect import Array

RAY_OFFSET = 0.03  # of the object's size: rays start so far in front; hits beyond twice that are
# another surface
NEIGHBOURS = 2.0 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])  # pixels to the right and down


@dataclass(frozen=True)
class DisplacedView:
    """x: (p,) pose parameters. more: (n, 3) normal under these minus the original normal. visible:
    (n,) fraction of the light that arrives. known: (n,) whether the rays hit the expected surface.
    ends: (n,) whether the surface or the light ends within two pixels."""

    x: NDArray[np.float64]
    more: Array
    visible: Array
    known: NDArray[np.bool_]
    ends: NDArray[np.bool_]

    @classmethod
    def of(
        cls, context: DiagnosisContext, displacement: Array, x: NDArray[np.float64]
    ) -> DisplacedView:
        """context: its pixels hold the changes of point and normal per pixel. displacement: (n, 3)
        approximate displacement of the visible point, scan units."""
        pixels, step = context.pixels, context.pixels.step
        met, shown = _shown(context, displacement)
        more, visible = np.zeros_like(pixels.normal), pixels.visible.astype(np.float32)
        more[met] = shown.normal - pixels.normal[met]
        lit = _lit(context, met, shown)
        ends = np.zeros(len(pixels), bool)
        for right, down in NEIGHBOURS:
            aside = _shown(context, displacement + right * step[:, 0] + down * step[:, 1])
            ends |= _lit(context, *aside) != lit
        visible[met] = np.where(lit[met], 1, _turned_away(shown))
        rows = np.flatnonzero((ends & met)[met])
        some = shown.select(rows)
        visible[np.flatnonzero(met)[rows]] = partial_visibility(context.rays, some, some.light)
        return cls(x, more, visible, met, ends)

    @property
    def dark_where_it_ends(self) -> DisplacedView:
        """The same, but dark where the visible point is uncertain."""
        certain = self.known & ~self.ends
        return replace(self, visible=np.where(certain, self.visible, np.float32(0)))


def _shown(context: DiagnosisContext, displacement: Array) -> tuple[NDArray[np.bool_], Pixels]:
    """((n,) whether the displaced rays hit the surface, those pixels with the points and normals
    that were hit)."""
    pixels, back = context.pixels, RAY_OFFSET * context.size
    view = pixels.view.astype(np.float64)
    start = pixels.point + displacement + back * view
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
    """(n,) whether light arrives at the visible point; False where the rays hit nothing."""
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
