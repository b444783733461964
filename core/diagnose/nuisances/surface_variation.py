"""How the surface differs from the scan from place to place: its normals, albedo and gloss.

Every scan is a little wrong everywhere, and no real material is the same everywhere. The model of a
diagnosis therefore always has a few parameters for every patch of the surface, with a Gaussian
prior whose scales the photos determine (empirical Bayes). A cause is what improves on that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...angles.vectors import tangents
from ..effects.base.effect import Array
from ..effects.base.image_formation import AddsRadiance, ChangesShading
from ..effects.base.parameters import Parameters
from ..effects.base.patch_effect import PatchEffect
from ..effects.base.surface_patches import surface_patches
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState

TILTS = ("first tilt", "second tilt", "bend along", "bend across", "bend aside")
ALBEDO = ("reflectance", "red", "green", "blue")
GLOSS = ("gloss",)
WAYS = (*TILTS, *ALBEDO, *GLOSS)
START_SCALES = (*(np.radians(1.0),) * 2, *(np.radians(0.5),) * 3, 0.05, *(0.01,) * 3, 0.03)
"""Standard deviations of the priors where the search for them starts: radians, relative, albedo
and ln tan θh."""
BOUNDS = (*(np.radians(25.0),) * 5, 0.9, *(0.5,) * 3, 0.7)
STEPS = (*(1e-3,) * 9, 5e-3)  # for difference quotients


@dataclass(frozen=True)
class SurfaceVariation(PatchEffect, ChangesShading, AddsRadiance):
    """Parameters of a patch: WAYS. first, other: (n, 3) tangents of its mean normal; middle:
    (P, 3) its centre; place: (n, 2) position of a pixel in it, in half widths; received: (n, 3)
    irradiance on the surface; width: of a patch, scan units."""

    first: Array
    other: Array
    middle: Array
    place: Array
    received: Array
    width: float
    cause = "surface_variation"
    deciding_photo = ""

    @classmethod
    def of(cls, context: DiagnosisContext) -> SurfaceVariation | None:
        return cls.across(context, 24)

    @classmethod
    def across(cls, context: DiagnosisContext, across: int) -> SurfaceVariation | None:
        """across: patches over the object's size. None where no patch has enough pixels."""
        patch = surface_patches(context, across)
        known = np.flatnonzero(patch >= 0)
        if not len(known):
            return None
        mean = _means(patch[known], context.pixels.normal[known])
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
        first, other = (v[patch].astype(np.float32) for v in tangents(mean))
        middle = _means(patch[known], context.pixels.point[known])
        width = context.size / across
        place = _place(context, middle[patch], first, other, width)
        received = ShadingState.of(context.pixels).received
        return cls(patch, START_SCALES, first, other, middle, place, received, width)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> SurfaceVariation:
        at = nearest.surface
        patch, first, other = self.patch[at], self.first[at], self.other[at]
        place = _place(context, self.middle[patch], first, other, self.width)
        received = ShadingState.of(context.pixels).received
        return replace(self, patch=patch, first=first, other=other, place=place, received=received)

    @property
    def parameters(self) -> Parameters:
        count = self.count
        names = [f"patch {k + 1}, {way}" for k in range(count) for way in WAYS]
        bound = np.tile(BOUNDS, count)
        alike = Parameters.alike(names, "", 1.0)
        return replace(
            alike, low=-bound, high=bound, step=np.tile(STEPS, count), deviation=self.deviation
        )

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        first, second, along, across, aside, more, _, _, _, gloss = self.at_patch(x).T
        u, v = self.place.T
        tilt = np.stack([first + along * u + across * v, second + across * u + aside * v], axis=1)
        normal = state.normal + tilt[:, :1] * self.first + tilt[:, 1:] * self.other
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        stretch = gloss if state.stretch is None else state.stretch + gloss
        irradiance = state.irradiance * (1 + more)[:, None]
        return replace(state, normal=normal, irradiance=irradiance, stretch=stretch)

    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: np.ndarray) -> Array:
        return self.at_patch(x)[:, 6:9] * self.received / np.pi

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return ""


def _means(patch: np.ndarray, values: Array) -> np.ndarray:
    """(P, 3) means of values (n, 3) over each patch; patch: (n,) its number."""
    count = np.maximum(np.bincount(patch), 1)
    sums = [np.bincount(patch, values[:, k].astype(np.float64)) for k in range(3)]
    return np.stack(sums, axis=1) / count[:, None]


def _place(
    context: DiagnosisContext, middle: Array, first: Array, other: Array, width: float
) -> Array:
    """(n, 2) positions of the context's pixels relative to the centres (n, 3) of their patches, in
    half widths, clipped to ±1.5: a pixel outside its nearest patch does not extrapolate the
    curvature far beyond the edge."""
    away = (context.pixels.point - middle) / (0.5 * width)
    place = np.stack([np.sum(away * along, axis=1) for along in (first, other)], axis=1)
    return np.clip(place, -1.5, 1.5).astype(np.float32)
