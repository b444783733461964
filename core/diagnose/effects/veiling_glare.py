"""Veiling glare: light that scatters in the lens is spread over the photo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext
from ..forward.shading_state import ShadingState
from .base.capabilities import NeedsPhoto
from .base.effect import Array
from .base.image_formation import CameraEffect
from .base.parameters import Parameters


@dataclass(frozen=True)
class VeilingGlare(CameraEffect, NeedsPhoto):
    """Parameters: the fraction of the light that scatters, and the balance between scattering near
    bright areas and over the whole photo (1: near only, −1: uniform only). veil: (n, 2, 3) the
    photo under a wide blur, and its mean."""

    veil: Array
    cause = "veiling_glare"
    systematic_error = 0.03  # the veil is computed from photos that contain it
    deciding_photo = "one photo with a hood on the lens and black behind the object"

    @classmethod
    def of(cls, context: DiagnosisContext) -> VeilingGlare:
        return cls(context.pixels.veil)

    @property
    def parameters(self) -> Parameters:
        return Parameters(
            ("part", "nearness"), ("", ""), np.array([0.1, 0.5]), np.array([0.0, -1.0]),
            np.array([0.6, 1.0]), np.array([1e-3, 1e-2]),
        )  # fmt: skip

    @property
    def degrees_of_freedom(self) -> int:
        return 1

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        about, even = 0.5 * (1 + x[1]), 0.5 * (1 - x[1])
        veil = about * self.veil[:, 0] + even * self.veil[:, 1]
        return (1 - x[0]) * radiance + x[0] * veil

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            f"The lens scatters {100 * x[0]:.1f} % of the light over the photo (veiling glare): "
            "dark areas near bright ones are too bright."
        )
