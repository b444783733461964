"""A constant in all pixel values: lifted blacks, or a black level that was not subtracted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.capabilities import ShownByBackground
from .base.effect import Array
from .base.image_formation import CameraEffect
from .base.parameters import Parameters

WHITE = 99.0  # percentile of the photos' radiance that counts as white
PRIOR_SCALE, BOUND = 0.02, 0.3  # of white: standard deviation of the prior, and bound
MIN_BOUND = 1e-3  # of white, less than which no photo shows
TOLERANCE = 0.25  # relative: of the background, which compression and noise change
CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True)
class BlackLevel(CameraEffect, ShownByBackground):
    """Parameters: the constant for red, green and blue, as a fraction of ``white``, a radiance.
    background: (k, 3) radiance of the background of each photo that shows one. As every pixel has
    the constant, none is darker."""

    white: float
    background: Array
    cause = "black_level"
    deciding_photo = "one photo with the lens covered"

    @classmethod
    def of(cls, context: DiagnosisContext) -> BlackLevel:
        white = max(float(np.percentile(context.pixels.observed, WHITE)), 1e-9)
        _, first = np.unique(context.pixels.photo, return_index=True)
        background = context.pixels.background[first]
        return cls(white, background[np.isfinite(background).all(axis=1)])

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> BlackLevel:
        return self

    @property
    def parameters(self) -> Parameters:
        every = Parameters.alike(CHANNELS, "of white", PRIOR_SCALE, -BOUND, BOUND)
        if not len(self.background):
            return every
        darkest = (1 + TOLERANCE) * self.background.min(axis=0) / self.white
        return replace(every, high=np.clip(darkest, MIN_BOUND, BOUND))

    def is_shown(self, x: np.ndarray) -> bool:
        level = self.white * float(np.mean(x))
        if level <= 0 or not len(self.background):
            return False
        return bool(np.all(np.abs(self.background.mean(axis=1) / level - 1) < TOLERANCE))

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        return radiance + (self.white * x).astype(np.float32)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        levels = ", ".join(f"{100 * v:+.1f}" for v in x)
        return (
            f"Black is not 0 in the photos: it is at {levels} % of white in red, green and blue "
            "(lifted blacks, or a black level that was not subtracted)."
        )
