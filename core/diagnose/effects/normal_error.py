"""Errors of the mesh's normals, patch by patch: the mesh is smoother or rougher than the surface.

Each patch is tilted and curved. Bumps are round; constant tilts per patch would leave residuals
above the noise where they are high.
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

TILT_SCALE = np.radians(2.0)  # standard deviation of the prior of a tilt
CURVATURE_SCALE = np.radians(1.0)  # the same of its change over half a patch
WAYS = ("first", "second", "bent along", "bent across", "bent aside")
MAX_TILT = np.radians(25.0)  # bound of every parameter


@dataclass(frozen=True)
class NormalError(PatchEffect, ChangesShading):
    """Parameters: for each patch of the surface the tangents of the two angles by which its normal
    is tilted, along ``first`` and ``other``, (n, 3) unit vectors, and their changes over half the
    width of the patch: of the first along first, of each along the other's direction, of the second
    along other. middle: (P, 3) centre of each patch; place: (n, 2) position of a pixel relative to
    it, along both directions, in half widths."""

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
        return cls(patch, (TILT_SCALE,) * 2 + (CURVATURE_SCALE,) * 3, first, other, middle, place)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> NormalError:
        at = nearest.surface
        patch, first, other = self.patch[at], self.first[at], self.other[at]
        place = _place(context, self.middle[patch], first, other)
        return replace(self, patch=patch, first=first, other=other, place=place)

    @property
    def parameters(self) -> Parameters:
        names = [f"patch {k + 1}, {way}" for k in range(self.count) for way in WAYS]
        alike = Parameters.alike(names, "rad", 1.0, -MAX_TILT, MAX_TILT)
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
            "The normals of the mesh are off by "
            f"{np.median(angle):.1f}° (median over patches; 95th percentile "
            f"{np.percentile(angle, 95):.1f}°). The mesh is too smooth or noisy."
        )


def _means(patch: np.ndarray, values: Array) -> np.ndarray:
    """(P, 3) means of values (n, 3) over each patch; patch: (n,) its number."""
    count = np.maximum(np.bincount(patch), 1)
    sums = [np.bincount(patch, values[:, k].astype(np.float64)) for k in range(3)]
    return np.stack(sums, axis=1) / count[:, None]


def _place(context: DiagnosisContext, middle: Array, first: Array, other: Array) -> Array:
    """(n, 2) positions of the context's pixels relative to the centres (n, 3) of their patches, in
    half widths, clipped to ±1.5: a pixel outside its nearest patch does not extrapolate the
    curvature far beyond the edge."""
    away = (context.pixels.point - middle) / (0.5 * context.size / ACROSS)
    place = np.stack([np.sum(away * along, axis=1) for along in (first, other)], axis=1)
    return np.clip(place, -1.5, 1.5).astype(np.float32)
