"""Veiling glare: light that scatters in the lens is spread over the photo."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext
from ..forward.shading_state import ShadingState
from .base.capabilities import NeedsPhoto
from .base.effect import Array
from .base.image_formation import CameraEffect
from .base.parameters import Parameters
from .base.shown_by_background import TOLERANCE, ShownByBackground, known_backgrounds

MIN_BOUND = 1e-3  # of the light: less than which no photo shows


@dataclass(frozen=True)
class VeilingGlare(CameraEffect, NeedsPhoto, ShownByBackground):
    """Parameters: the fraction of the light that scatters, and the balance between scattering near
    bright areas and over the whole photo (1: near only, −1: uniform only). veil: (n, 2, 3) the
    photo under a wide blur, and its mean. The background has the veil too."""

    veil: Array
    background: Array
    cause = "veiling_glare"
    systematic_error = 0.03  # the veil is computed from photos that contain it
    deciding_photo = "one photo with a hood on the lens and black behind the object"

    @classmethod
    def of(cls, context: DiagnosisContext) -> VeilingGlare:
        return cls(context.pixels.veil, known_backgrounds(context))

    @property
    def parameters(self) -> Parameters:
        every = Parameters(
            ("part", "nearness"), ("", ""), np.array([0.1, 0.5]), np.array([0.0, -1.0]),
            np.array([0.6, 1.0]), np.array([1e-3, 1e-2]),
        )  # fmt: skip
        if not len(self.background):
            return every
        radiance, veil = self.background[:, 0], mixed(self.background[:, 1:], 0.0)
        most = (1 + TOLERANCE) * np.min(radiance.mean(axis=1) / np.maximum(veil.mean(axis=1), 1e-9))
        return replace(every, high=np.array([np.clip(most, MIN_BOUND, every.high[0]), 1.0]))

    @property
    def degrees_of_freedom(self) -> int:
        return 1

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        return (1 - x[0]) * radiance + x[0] * mixed(self.veil, x[1])

    def in_background(self, x: np.ndarray) -> Array:
        return np.asarray(x[0] * mixed(self.background[:, 1:], x[1]))

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            f"The lens scatters {100 * x[0]:.1f} % of the light over the photo (veiling glare): "
            "dark areas near bright ones are too bright."
        )


def mixed(veil: Array, nearness: float) -> Array:
    """(n, 3) of veils (n, 2, 3), the blurred photo and its mean. nearness: −1 to 1."""
    near = 0.5 * (1 + nearness)
    return near * veil[:, 0] + (1 - near) * veil[:, 1]
