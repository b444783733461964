"""Vignetting: the lens darkens the corners of the photos."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext
from ..forward.shading_state import ShadingState
from .base.effect import Array
from .base.image_formation import CameraEffect
from .base.parameters import Parameters


@dataclass(frozen=True)
class Vignetting(CameraEffect):
    """Parameters: a, b of the gain 1 + a r² + b r⁴, where r is the distance from the photo's
    centre, 1 in a corner. r2: (n,) r²."""

    r2: Array
    cause = "vignetting"
    deciding_photo = "one photo with the object in a corner"

    @classmethod
    def of(cls, context: DiagnosisContext) -> Vignetting:
        return cls(np.square(context.pixels.x) + np.square(context.pixels.y))

    @property
    def parameters(self) -> Parameters:
        return Parameters(
            ("r²", "r⁴"), ("", ""), np.array([0.4, 0.4]), np.array([-2.0, -2.0]),
            np.array([1.0, 2.0]), np.array([1e-3, 1e-3]),
        )  # fmt: skip

    def gain(self, x: np.ndarray) -> Array:
        """(n,) relative transmission of the lens, at least 0.05."""
        return np.maximum(1 + x[0] * self.r2 + x[1] * self.r2**2, 0.05)

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        return radiance * self.gain(x)[:, None]

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        gain = self.gain(x)
        return (
            "The brightness of the photos varies with the distance from their centre (vignetting): "
            f"by {100 * (gain[np.argmax(self.r2)] - 1):+.0f} % at the outermost pixels of the "
            "object, relative to the centre."
        )
