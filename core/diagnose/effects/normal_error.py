"""The mesh is smoother or rougher than the surface: its normals are off, patch by patch.

A patch is tilted, and bends: bumps are round, and what mere steps from patch to patch would leave
of deep ones is more than noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...angles.vectors import tangents
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.effect import Array
from .base.image_formation import ChangesShading
from .base.parameters import Parameters
from .base.patch_effect import PatchEffect
from .base.surface_patches import ACROSS, surface_patches

USUAL = np.radians(2.0)
BENT = np.radians(1.0)  # over half a patch
WAYS = ("first", "second", "bent along", "bent across", "bent aside")
FARTHEST = np.radians(25.0)


@dataclass(frozen=True)
class NormalError(PatchEffect, ChangesShading):
    """numbers: for each patch of the surface the tangents of two angles that its normal is tilted
    by, along ``first`` and ``other``, (n, 3) unit, and what these grow by over half its width: the
    first along first, each along the other's, the second along other. middle: (P, 3) of each
    patch; place: (n, 2) of a pixel from there, along both, in half widths."""

    first: Array
    other: Array
    middle: Array
    place: Array
    cause = "normal_error"
    deciding_photo = "a closer scan of a part of the surface"

    @classmethod
    def of(cls, context: DiagnosisContext) -> NormalError | None:
        patch = surface_patches(context)
        known = np.flatnonzero(patch >= 0)
        if not len(known):
            return None
        mean = _means(patch[known], context.pixels.normal[known])
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
        first, other = (v[patch].astype(np.float32) for v in tangents(mean))
        middle = _means(patch[known], context.pixels.point[known])
        place = _place(context, middle[patch], first, other)
        return cls(patch, (USUAL,) * 2 + (BENT,) * 3, first, other, middle, place)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> NormalError:
        at = nearest.surface
        patch, first, other = self.patch[at], self.first[at], self.other[at]
        place = _place(context, self.middle[patch], first, other)
        return replace(self, patch=patch, first=first, other=other, place=place)

    @property
    def parameters(self) -> Parameters:
        names = [f"patch {k + 1}, {way}" for k in range(self.count) for way in WAYS]
        alike = Parameters.alike(names, "rad", 1.0, -FARTHEST, FARTHEST)
        return replace(alike, deviation=self.deviation)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        first, second, along, across, aside = self.at_patch(x).T
        u, v = self.place.T
        tilt = np.stack([first + along * u + across * v, second + across * u + aside * v], axis=1)
        normal = state.normal + tilt[:, :1] * self.first + tilt[:, 1:] * self.other
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return replace(state, normal=normal)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        tilt = x.reshape(-1, len(WAYS))[:, :2]
        angle = np.degrees(np.hypot(*tilt.T))
        return (
            "the mesh does not follow the surface: its normals are off by "
            f"{np.median(angle):.1f}° in the median and {np.percentile(angle, 95):.1f}° in the "
            "worst twentieth (too smooth a mesh, or a noisy one)"
        )


def _means(patch: np.ndarray, values: Array) -> np.ndarray:
    """(P, 3) of values (n, 3) by patch (n,)."""
    count = np.maximum(np.bincount(patch), 1)
    sums = [np.bincount(patch, values[:, k].astype(np.float64)) for k in range(3)]
    return np.stack(sums, axis=1) / count[:, None]


def _place(context: DiagnosisContext, middle: Array, first: Array, other: Array) -> Array:
    """(n, 2) of the context's pixels from the middles (n, 3) of their patches, in half widths of
    one; a patch that is the nearest to what it does not hold bends no further than a little beyond
    its edge."""
    away = (context.pixels.point - middle) / (0.5 * context.size / ACROSS)
    place = np.stack([np.sum(away * along, axis=1) for along in (first, other)], axis=1)
    return np.clip(place, -1.5, 1.5).astype(np.float32)
