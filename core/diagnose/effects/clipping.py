"""Undeclared clipping: highlights of the photos end at a plateau."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.capabilities import AffectsHighlightsOnly, JudgedByPixel
from .base.effect import Array
from .base.image_formation import CameraEffect
from .base.parameters import Parameters

SOFT = 0.01  # fraction of the plateau over which the transition is smooth
# values of a channel near a plateau that confirm it; relative distance that counts as near
MIN_VALUES, NEAR_PLATEAU = 12, 0.03
PILED_UP = 4.0  # values near a plateau for each one in an interval of the same width below it


@dataclass(frozen=True)
class Clipping(CameraEffect, AffectsHighlightsOnly, JudgedByPixel):
    """Parameters: for each channel, ln(8 top / plateau). top: (3,) the largest value of each
    channel. observed: (n, 3) radiance."""

    top: Array
    observed: Array
    cause = "clipping"
    deciding_photo = "one photo of each view at a quarter of the exposure"

    @classmethod
    def of(cls, context: DiagnosisContext) -> Clipping:
        seen = context.pixels.observed
        return cls(np.maximum(seen.max(axis=0), 1e-9).astype(np.float64), seen)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> Clipping:
        return self

    @property
    def parameters(self) -> Parameters:
        # a plateau far above the largest value has no effect; at 0 it is at 8 times that value
        return Parameters.alike(
            ["red", "green", "blue"], "ln", 2.0, 0.0, 4.0, step=5e-3, start=np.log(8.0)
        )

    def plateau(self, x: np.ndarray) -> Array:
        """(3,) radiance that no photo exceeds."""
        return self.top * 8.0 * np.exp(-x)

    def shows_plateau(self, predicted: Array, deviation: Array) -> bool:
        """Whether far more values lie just below the largest ones than below these: of all values,
        or of those that should be larger. predicted: (n, 3) without clipping. deviation: (n, 3),
        inf for pixels that are known to be clipped."""
        counted = np.isfinite(deviation).all(axis=1)
        for seen, expected in zip(self.observed[counted].T, predicted[counted].T, strict=True):
            if len(seen) < MIN_VALUES:
                return False
            top = float(np.sort(seen)[-MIN_VALUES])
            higher = seen[expected > (1 + NEAR_PLATEAU) * top]
            if _piled_up(seen, top, 3 * MIN_VALUES) or _piled_up(higher, top, MIN_VALUES):
                return True
        return False

    def is_relevant(self, x: np.ndarray) -> bool:
        near = np.abs(self.observed / self.plateau(x) - 1) < NEAR_PLATEAU
        return bool((near.sum(axis=0) >= MIN_VALUES).any())

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        plateau = self.plateau(x)
        over = (radiance - plateau) / (SOFT * plateau)
        return radiance - SOFT * plateau * np.logaddexp(0.0, over)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            "Highlights are clipped: no photo exceeds a radiance of "
            f"{', '.join(f'{v:.3g}' for v in self.plateau(x))} (red, green, blue), although the "
            "surface is brighter."
        )


def _piled_up(values: Array, top: float, least: int) -> bool:
    near = np.count_nonzero(values > (1 - NEAR_PLATEAU) * top)
    below = np.count_nonzero(values > (1 - 2 * NEAR_PLATEAU) * top) - near
    return near >= least and near > PILED_UP * below
