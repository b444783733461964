"""How the surface differs from the scan from place to place: its normals, albedo and gloss.

Every scan is a little wrong everywhere, and no real material is the same everywhere. The model of a
diagnosis therefore always has a few parameters for every patch of the surface, with a Gaussian
prior whose scales the photos determine (empirical Bayes). A cause is what improves on that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..effects.base.effect import Array
from ..effects.base.image_formation import AddsRadiance, ChangesShading
from ..effects.base.parameters import Parameters
from ..effects.base.patch_effect import PatchEffect
from ..effects.base.patch_frames import PatchFrames
from ..effects.base.surface_patches import ACROSS, surface_patches
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
    """Parameters of a patch: WAYS. received: (n, 3) irradiance on the surface."""

    frames: PatchFrames
    received: Array
    cause = "surface_variation"
    deciding_photo = ""

    @classmethod
    def of(cls, context: DiagnosisContext) -> SurfaceVariation | None:
        return cls.across(context, ACROSS)

    @classmethod
    def across(cls, context: DiagnosisContext, across: int) -> SurfaceVariation | None:
        """across: patches over the object's size. None where no patch has enough pixels."""
        patch = surface_patches(context, across)
        if not (patch >= 0).any():
            return None
        frames = PatchFrames.of(context, patch, context.size / across)
        return cls(patch, START_SCALES, frames, ShadingState.of(context.pixels).received)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> SurfaceVariation:
        patch = self.patch[nearest.surface]
        frames = self.frames.at_pixels(context, nearest.surface, patch)
        received = ShadingState.of(context.pixels).received
        return replace(self, patch=patch, frames=frames, received=received)

    @property
    def parameters(self) -> Parameters:
        count = self.count
        names = [f"patch {k + 1}, {way}" for k in range(count) for way in WAYS]
        bound = np.tile(BOUNDS, count)
        alike = Parameters.alike(names, "", 1.0)
        return replace(
            alike, low=-bound, high=bound, step=np.tile(STEPS, count), deviation=self.deviation
        )

    @property
    def combined_slots(self) -> Mapping[int, Mapping[int, Array]]:
        """A bend is a tilt that grows with the distance from the patch's centre."""
        u, v = self.frames.place.T
        return {2: {0: u}, 3: {0: v, 1: u}, 4: {1: v}}

    @property
    def slots_without_lamp_light(self) -> frozenset[int]:
        return frozenset(WAYS.index(colour) for colour in ALBEDO[1:])

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        first, second, *bends, more, _, _, _, gloss = self.at_patch(x).T
        normal = self.frames.tilted(state.normal, first, second, bends)
        stretch = gloss if state.stretch is None else state.stretch + gloss
        irradiance = state.irradiance * (1 + more)[:, None]
        return replace(state, normal=normal, irradiance=irradiance, stretch=stretch)

    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: np.ndarray) -> Array:
        return self.at_patch(x)[:, 6:9] * self.received / np.pi

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return ""
