"""A nonlinear camera response: pixel values are not proportional to radiance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.effect import Array
from .base.image_formation import CameraEffect
from .base.parameters import Parameters

PRIOR_SCALE = 0.15  # of the exponent, standard deviation of the prior
WHITE = 99.0  # percentile of the photos' radiance that counts as white
DARKEST = 1e-4  # of the mean radiance; the logarithm of darker values is clamped


@dataclass(frozen=True)
class CameraResponse(CameraEffect):
    """Parameters: the exponent minus 1, and its change over a factor e of brightness. The curve
    keeps ``grey``, the mean radiance of the photos, because the overall brightness carries no
    information about the curve."""

    grey: float
    cause = "camera_response"
    deciding_photo = "two photos of one view, one of them at half the exposure"

    @classmethod
    def of(cls, context: DiagnosisContext) -> CameraResponse:
        seen = context.pixels.observed
        white = float(np.percentile(seen, WHITE))
        return cls(max(float(np.minimum(seen, white).mean()), 1e-9))

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> CameraResponse:
        return self

    @property
    def parameters(self) -> Parameters:
        return Parameters(
            ("gamma − 1", "its change"), ("", "1/ln"), np.array([PRIOR_SCALE, 0.03]),
            np.array([-0.7, -0.15]), np.array([1.5, 0.15]), np.array([1e-3, 1e-3]),
        )  # fmt: skip

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        level = np.log(np.maximum(radiance / self.grey, DARKEST))
        return radiance * np.exp(x[0] * level + x[1] * level * np.abs(level))

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        way = "flatter" if x[0] < 0 else "steeper"
        return (
            f"The photos are not linear: their values follow radiance to the power {1 + x[0]:.2f}, "
            f"which is {way} than linear (a tone curve was applied, or the wrong one was removed)."
        )
