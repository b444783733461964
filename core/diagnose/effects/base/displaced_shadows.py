"""Shadows of a displaced lamp. Under grazing light they move farther than the lamp."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...forward.diagnosis_context import DiagnosisContext
from ...forward.partial_visibility import partial_visibility, pixel_part_points
from ...forward.shading_state import ShadingState
from .effect import Array
from .image_formation import ChangesShading


@dataclass(frozen=True)
class DisplacedShadows:
    """x: (p,) parameters of the effect that displaces the lamp. more: (n,) visibility of the
    displaced lamp minus that of the lamp as the capture gives it."""

    x: NDArray[np.float64]
    more: Array

    @classmethod
    def of(
        cls, context: DiagnosisContext, effect: ChangesShading, x: NDArray[np.float64]
    ) -> DisplacedShadows:
        """effect: without displaced shadows. x: (p,) its parameters."""
        pixels = context.pixels
        towards = effect.shading(ShadingState.of(pixels), x).light
        # both by the same rays, so that their errors in folds cancel
        parts = pixel_part_points(context.rays, pixels)
        was, will = (
            partial_visibility(context.rays, pixels, to, parts=parts)
            for to in (pixels.light, towards)
        )
        return cls(x, will - was)

    def on(self, state: ShadingState) -> ShadingState:
        """The state with these shadows."""
        visible = np.clip(state.visible + self.more, 0, 1).astype(np.float32)
        return replace(state, visible=visible)
