"""A second material: parts of the surface are brighter, darker or of another colour."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState
from .base.effect import Array
from .base.image_formation import AddsRadiance, ChangesShading
from .base.parameters import Parameters
from .base.patch_effect import PatchEffect
from .base.surface_patches import median_of, surface_patches

ACROSS = 10  # patches over the object's size; few other pixels predict a smaller one
PRIOR_SCALES = (0.1, 0.05, 0.05, 0.05)  # of a patch's parameters, standard deviations
LIT = 0.2  # of the 90th percentile of irradiance; darker pixels do not determine a patch's start
OTHER = 0.03  # difference in scale or albedo from the median patch that makes another material
EACH = 4  # parameters of a patch


@dataclass(frozen=True)
class SecondMaterial(PatchEffect, ChangesShading, AddsRadiance):
    """Parameters: for each patch of the surface the relative change of the material's reflectance,
    and an added diffuse albedo for red, green and blue. (All are linear, so that a Newton step
    predicts a held-out patch, whose parameters return to 0, as well as the model itself.)
    received: (n, 3) irradiance at each pixel."""

    received: Array
    cause = "second_material"
    deciding_photo = "a mask of the part that looks different, painted in one photo"

    @classmethod
    def of(cls, context: DiagnosisContext) -> SecondMaterial | None:
        parts = surface_patches(context, ACROSS)
        if not (parts >= 0).any():
            return None
        return cls(parts, PRIOR_SCALES, ShadingState.of(context.pixels).received)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> SecondMaterial:
        received = ShadingState.of(context.pixels).received
        return replace(self, patch=self.patch[nearest.surface], received=received)

    @property
    def parameters(self) -> Parameters:
        count = self.count
        kinds = ("more", "red", "green", "blue")
        names = [f"patch {k + 1}, {kind}" for k in range(count) for kind in kinds]
        low, high = np.tile([-0.95, -1, -1, -1], count), np.tile([9.0, 1, 1, 1], count)
        return replace(
            Parameters.alike(names, "", 1.0), low=low, high=high, deviation=self.deviation
        )

    def initial(self, residual: Array, predicted: Array) -> np.ndarray:
        level = self.received.mean(axis=1)
        lit = level > LIT * np.percentile(level, 90)
        albedo = np.where(lit[:, None], np.pi * residual / np.where(lit, level, 1)[:, None], 0)
        out = np.zeros((self.count, EACH))
        for c in range(3):
            out[:, 1 + c] = np.clip(median_of(self.patch, albedo[:, c]), -1, 1)
        return out.ravel()

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        return replace(state, irradiance=state.irradiance * (1 + self.at_patch(x)[:, :1]))

    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: np.ndarray) -> Array:
        return self.at_patch(x)[:, 1:] * self.received / np.pi

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        patches = x.reshape(-1, EACH) - np.median(x.reshape(-1, EACH), axis=0)
        more, albedo = patches[:, 0], patches[:, 1:].mean(axis=1)
        other = (np.abs(more) > OTHER) | (np.abs(albedo) > OTHER)
        share = 100 * float(other.mean())
        factor, even = (float(v[other].mean()) if other.any() else 0.0 for v in (more, albedo))
        return (
            f"There is more than one material: {share:.0f} % of the surface differs from the rest "
            f"by {100 * factor:+.0f} % in reflectance and {even:+.3f} in diffuse albedo. "
            "Paint a mask of this part."
        )
