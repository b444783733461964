"""Shadows that move with the lamp: where light grazes the object, by more than the lamp does."""

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
    """more: (n,) part of the light that arrives where an effect with numbers x (p,) puts the lamp,
    less what arrives from where the capture does."""

    x: NDArray[np.float64]
    more: Array

    @classmethod
    def of(
        cls, context: DiagnosisContext, effect: ChangesShading, x: NDArray[np.float64]
    ) -> DisplacedShadows:
        """effect: without shadows of its own."""
        pixels = context.pixels
        towards = effect.shading(ShadingState.of(pixels), x).light
        # of both in one way: what rays from parts of a pixel miss of a fold is the same
        parts = pixel_part_points(context.rays, pixels)
        was, will = (
            partial_visibility(context.rays, pixels, to, parts=parts)
            for to in (pixels.light, towards)
        )
        return cls(x, will - was)

    def on(self, state: ShadingState) -> ShadingState:
        """With these shadows."""
        visible = np.clip(state.visible + self.more, 0, 1).astype(np.float32)
        return replace(state, visible=visible)
