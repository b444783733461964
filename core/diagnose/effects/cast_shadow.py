"""Shadows of things that are not in the mesh: a tripod, a wall, parts that were not scanned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.direct_radiance import direct_radiance
from ..forward.shading_state import ShadingState
from ..pixels.certain_shadows import certain_shadows
from ..pixels.unexplained_shadows import unexplained_shadows
from .base.capabilities import JudgedByPixel
from .base.effect import Array
from .base.image_formation import ChangesShading
from .base.parameters import Parameters
from .base.patch_effect import PatchEffect
from .base.surface_patches import median_of

PRIOR_SCALE = 0.6  # of the light, standard deviation of the prior
DARK = 0.2  # fraction of the light that is lost, above which a spot counts as shadowed


@dataclass(frozen=True)
class CastShadow(PatchEffect, ChangesShading, JudgedByPixel):
    """Parameters: for each dark spot of a photo, minus the fraction of the light that is lost.
    photo: (n,) number of each pixel's photo."""

    photo: NDArray[np.int16]
    cause = "cast_shadow"
    deciding_photo = "a photo of everything that stands around the object, taken from the lamp"
    # pixels at the edge of a spot lose less light, and the patches' reflectance has absorbed a part
    systematic_error = 0.02

    @classmethod
    def of(cls, context: DiagnosisContext) -> CastShadow | None:
        pixels = context.pixels
        spot = unexplained_shadows(pixels, direct_radiance(pixels, context.brdfs))
        return None if (spot < 0).all() else cls(spot, (PRIOR_SCALE,), pixels.photo)

    @classmethod
    def in_residual(
        cls, context: DiagnosisContext, predicted: Array, residual: Array
    ) -> CastShadow | None:
        """Spots that are darker than a model predicts, and that are not errors of the scan. None
        where there are none. predicted: (n, 3); residual: (n, 3) in standard deviations."""
        pixels = context.pixels
        spot = certain_shadows(context, unexplained_shadows(pixels, predicted), residual)
        return None if (spot < 0).all() else cls(spot, (PRIOR_SCALE,), pixels.photo)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> CastShadow:
        return replace(self, patch=self.patch[nearest.photo], photo=self.photo[nearest.photo])

    @property
    def parameters(self) -> Parameters:
        names = [f"spot {k + 1}" for k in range(self.count)]
        alike = Parameters.alike(names, "of the light", 1.0, -1.0, 0.0, step=-1e-2)
        return replace(alike, deviation=self.deviation)

    def initial(self, residual: Array, predicted: Array) -> np.ndarray:
        part = residual.sum(axis=1) / np.maximum(predicted.sum(axis=1), 1e-30)
        return np.clip(median_of(self.patch, part), -1, 0)

    def is_relevant(self, x: np.ndarray) -> bool:
        return bool((-x > DARK).any())

    def lost(self, x: np.ndarray) -> Array:
        """(n,) fraction of the light that does not arrive."""
        return -self.at_patch(x)[:, 0]

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        return replace(state, visible=state.visible * (1 - self.lost(x)).astype(np.float32))

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        dark = self.lost(x) > DARK
        count = np.bincount(self.photo, minlength=1)
        part = np.bincount(self.photo, dark, len(count)) / np.maximum(count, 1)
        worst = int(np.argmax(part))
        return (
            "Something that is not in the mesh casts a shadow on the object in "
            f"{int(np.sum(part > 0))} of {int(np.sum(count > 0))} photos. It removes up to "
            f"{100 * -x.min():.0f} % of the light and covers up to {100 * part[worst]:.2g} % of "
            f"the checked pixels of a photo (photo {worst + 1})."
        )
