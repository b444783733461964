"""The lamp drifted, or an exposure is wrong: every photo has a brightness of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.image_formation import ChangesShading
from .base.parameters import Parameters, mean_removal, parameter_columns

USUAL = 0.1  # of the logarithm


@dataclass(frozen=True)
class LightIntensity(ChangesShading):
    """numbers: ln of each photo's gain; what they have in common is the BRDF's, and the prior
    keeps their mean at 0. photo: (n,) place of each pixel's among ``photos``, their numbers."""

    photos: tuple[int, ...]
    photo: NDArray[np.intp]
    cause = "light_intensity"
    deciding_photo = "a grey card beside the object in every photo"

    @classmethod
    def of(cls, context: DiagnosisContext) -> LightIntensity | None:
        photos, place = np.unique(context.pixels.photo, return_inverse=True)
        return cls(tuple(photos.tolist()), place.ravel()) if len(photos) > 1 else None

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> LightIntensity:
        return replace(self, photo=self.photo[nearest.photo])

    @property
    def parameters(self) -> Parameters:
        names = [f"photo {p + 1}" for p in self.photos]
        return Parameters.alike(names, "ln", USUAL, -1.5, 1.5)

    @property
    def columns(self) -> NDArray[np.intp]:
        return parameter_columns(self.photo, 1)

    @property
    def identifiable(self) -> NDArray[np.float64]:
        return mean_removal(len(self.photos), 1, 0)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        gain = np.exp(x)[self.photo].astype(np.float32)
        return replace(state, irradiance=state.irradiance * gain[:, None])

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        gain = np.exp(x - x.mean())
        low, high = int(np.argmin(gain)), int(np.argmax(gain))
        return (
            "the light (or the exposure) changed between photos: photo "
            f"{self.photos[high] + 1} is {100 * (gain[high] - 1):+.0f} %, photo "
            f"{self.photos[low] + 1} {100 * (gain[low] - 1):+.0f} % against the mean"
        )
