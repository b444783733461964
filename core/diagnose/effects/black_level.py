"""A constant in all pixel values: lifted blacks, or a black level that was not subtracted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.effect import Array
from .base.image_formation import CameraEffect
from .base.parameters import Parameters
from .base.shown_by_background import TOLERANCE, ShownByBackground, known_backgrounds

WHITE = 99.0  # percentile of the photos' radiance that counts as white
PRIOR_SCALE, BOUND = 0.02, 0.3  # of white: standard deviation of the prior, and bound
MIN_BOUND = 1e-3  # of white, less than which no photo shows
CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True)
class BlackLevel(CameraEffect, ShownByBackground):
    """Parameters: the constant for red, green and blue, as a fraction of ``white``, a radiance.
    As every pixel has the constant, no background is darker."""

    white: float
    background: Array
    cause = "black_level"
    deciding_photo = "one photo with the lens covered"

    @classmethod
    def of(cls, context: DiagnosisContext) -> BlackLevel:
        white = max(float(np.percentile(context.pixels.observed, WHITE)), 1e-9)
        return cls(white, known_backgrounds(context))

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> BlackLevel:
        return self

    @property
    def parameters(self) -> Parameters:
        every = Parameters.alike(CHANNELS, "of white", PRIOR_SCALE, -BOUND, BOUND)
        if not len(self.background):
            return every
        darkest = (1 + TOLERANCE) * self.background[:, 0].min(axis=0) / self.white
        return replace(every, high=np.clip(darkest, MIN_BOUND, BOUND))

    def in_background(self, x: np.ndarray) -> Array:
        return np.tile(self.white * x, (len(self.background), 1))

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        return radiance + (self.white * x).astype(np.float32)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        levels = ", ".join(f"{100 * v:+.1f}" for v in x)
        return (
            f"Black is not 0 in the photos: it is at {levels} % of white in red, green and blue "
            "(lifted blacks, or a black level that was not subtracted)."
        )
