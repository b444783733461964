"""Errors of the mesh's normals, patch by patch: the mesh is smoother or rougher than the surface.

Each patch is tilted and curved. Bumps are round; constant tilts per patch would leave residuals
above the noise where they are high.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.image_formation import ChangesShading
from .base.parameters import Parameters
from .base.patch_effect import PatchEffect
from .base.patch_frames import PatchFrames
from .base.surface_patches import ACROSS, surface_patches

TILT_SCALE = np.radians(2.0)  # standard deviation of the prior of a tilt
CURVATURE_SCALE = np.radians(1.0)  # the same of its change over half a patch
WAYS = ("first", "second", "bent along", "bent across", "bent aside")
MAX_TILT = np.radians(25.0)  # bound of every parameter


@dataclass(frozen=True)
class NormalError(PatchEffect, ChangesShading):
    """Parameters: for each patch of the surface the tangents of the two angles by which its normal
    is tilted, along both tangents of its frame, and their changes over half the width of the patch
    (PatchFrames.tilted)."""

    frames: PatchFrames
    cause = "normal_error"
    deciding_photo = "a closer scan of a part of the surface"

    @classmethod
    def of(cls, context: DiagnosisContext) -> NormalError | None:
        patch = surface_patches(context)
        if not (patch >= 0).any():
            return None
        frames = PatchFrames.of(context, patch, context.size / ACROSS)
        return cls(patch, (TILT_SCALE,) * 2 + (CURVATURE_SCALE,) * 3, frames)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> NormalError:
        patch = self.patch[nearest.surface]
        frames = self.frames.at_pixels(context, nearest.surface, patch)
        return replace(self, patch=patch, frames=frames)

    @property
    def parameters(self) -> Parameters:
        names = [f"patch {k + 1}, {way}" for k in range(self.count) for way in WAYS]
        alike = Parameters.alike(names, "rad", 1.0, -MAX_TILT, MAX_TILT)
        return replace(alike, deviation=self.deviation)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        first, second, *bends = self.at_patch(x).T
        return replace(state, normal=self.frames.tilted(state.normal, first, second, bends))

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        tilt = x.reshape(-1, len(WAYS))[:, :2]
        angle = np.degrees(np.hypot(*tilt.T))
        return (
            "The normals of the mesh are off by "
            f"{np.median(angle):.1f}° (median over patches; 95th percentile "
            f"{np.percentile(angle, 95):.1f}°). The mesh is too smooth or noisy."
        )
