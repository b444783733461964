"""How materials vary over the surface, as estimated before the diagnosis.

Texture is finer than the patches of SurfaceVariation. Without it, the residual of an object that is
painted or corroded is its texture, which hides any effect of a few percent. The variation is a
fixed part of the model: it has no parameters. Patches of SurfaceVariation absorb its errors, those
of an effect that it imitates included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effects.base.effect import Effect
from ..effects.base.image_formation import ChangesShading
from ..effects.base.parameters import Parameters
from ..effects.base.surface_patches import mean_of
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.known_variation import VariationAtPixels
from ..forward.shading_state import ShadingState


@dataclass(frozen=True)
class FineVariation(ChangesShading):
    """There are no parameters. known: at the pixels."""

    known: VariationAtPixels
    cause = "fine_variation"
    deciding_photo = ""

    @classmethod
    def of(cls, context: DiagnosisContext) -> FineVariation | None:
        """None where all materials are even."""
        variation = context.variation
        return None if variation is None else cls(variation.at(context.pixels))

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> FineVariation | None:
        return FineVariation.of(context)

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike((), "", 1.0)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        return replace(
            state,
            normal=self.known.normal,
            irradiance=state.irradiance * self.known.reflectance,
            albedo=self.known.albedo,
        )

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return ""


def log_albedo_of_patches(
    effects: Sequence[Effect], patch: NDArray[np.intp]
) -> NDArray[np.float64]:
    """(p, 3) mean of the logarithm of the known factor of the albedo in each patch, 0 where no
    effect knows it. patch: (n,) of each pixel, −1 none."""
    for effect in effects:
        if isinstance(effect, FineVariation):
            return mean_of(patch, np.log(effect.known.albedo))
    return np.zeros((int(patch.max(initial=-1)) + 1, 3))
