"""The surface is brushed or woven: it reflects along one direction more widely than across."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..along_surface import axes_along, half_vector_along
from ..effect import Array, Effect, Numbers, Setting
from ..situation import Situation


@dataclass(frozen=True)
class Anisotropy(Effect):
    """numbers: for each of the scan's axes how much ln tan θh grows where the half vector lies
    along that axis' direction on the surface. axes: (n, 3, 3) these directions, unit."""

    axes: Array
    cause = "anisotropy"
    blurs = True
    proof = "the object turned by 90° under the same light"

    @classmethod
    def of(cls, setting: Setting) -> Anisotropy:
        n = setting.pixels.normal.astype(np.float64)
        axes = axes_along(n)
        return cls(axes / np.maximum(np.linalg.norm(axes, axis=2, keepdims=True), 1e-3))

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike(["x", "y", "z"], "ln", 0.3, -2.0, 2.0)

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        flat = half_vector_along(now.normal, now.light, now.pixels.view)
        flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9)
        along = np.einsum("nax,nx->na", self.axes, flat)
        stretch = (along**2 - 0.5) @ x
        return replace(now, stretch=stretch if now.stretch is None else now.stretch + stretch)

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        k = int(np.argmax(np.abs(x)))
        return (
            "the surface reflects along one direction more widely than across it (brushed, woven "
            f"or turned), about the scan's {'xyz'[k]} axis: highlights are "
            f"{np.exp(abs(x[k])):.2f} times as long as wide"
        )
