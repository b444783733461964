"""Anisotropic reflection: highlights of a brushed or woven surface are wider in one direction."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext
from ..forward.shading_state import ShadingState
from ..forward.tangent_directions import tangential_axes, tangential_half_vector
from .base.capabilities import WidensHighlights
from .base.effect import Array
from .base.image_formation import ChangesShading
from .base.parameters import Parameters


@dataclass(frozen=True)
class Anisotropy(ChangesShading, WidensHighlights):
    """Parameters: for each axis of the scan, the increase of ln tan θh where the half vector is
    tilted along the projection of that axis onto the surface. axes: (n, 3, 3) these projections,
    unit vectors."""

    axes: Array
    cause = "anisotropy"
    deciding_photo = "the object turned by 90° under the same light"

    @classmethod
    def of(cls, context: DiagnosisContext) -> Anisotropy:
        n = context.pixels.normal.astype(np.float64)
        axes = tangential_axes(n)
        return cls(axes / np.maximum(np.linalg.norm(axes, axis=2, keepdims=True), 1e-3))

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike(["x", "y", "z"], "ln", 0.3, -2.0, 2.0)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        flat = tangential_half_vector(state.normal, state.light, state.pixels.view)
        flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9)
        along = np.einsum("nax,nx->na", self.axes, flat)
        stretch = (along**2 - 0.5) @ x
        return replace(state, stretch=stretch if state.stretch is None else state.stretch + stretch)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        k = int(np.argmax(np.abs(x)))
        return (
            "Reflection is anisotropic (brushed, woven or turned surface) with respect to the "
            f"{'xyz'[k]} axis of the scan: highlights are {np.exp(abs(x[k])):.2f} times as long "
            "as they are wide."
        )
