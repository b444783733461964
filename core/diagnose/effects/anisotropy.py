"""The surface is brushed or woven: it reflects along one direction more widely than across."""

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
    """numbers: for each of the scan's axes how much ln tan θh grows where the half vector lies
    along that axis' direction on the surface. axes: (n, 3, 3) these directions, unit."""

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
            "the surface reflects along one direction more widely than across it (brushed, woven "
            f"or turned), about the scan's {'xyz'[k]} axis: highlights are "
            f"{np.exp(abs(x[k])):.2f} times as long as wide"
        )
