"""BRDFs of layers over pairs of directions, and the GGX lobe that they share.

α = roughness², Smith's height-correlated masking (Heitz 2014).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, light_view

Array = NDArray[np.floating]


class LayeredModel(ABC):
    """A BRDF of layers; not reciprocal, so light and view are not interchangeable."""

    def evaluate(self, angles: Angles) -> Array:
        """f (..., 3) in 1/sr at half/difference angles (radians) of any shape."""
        light, view = light_view(*angles)
        return self.reflectance(light, view)

    def reflectance(self, light: Array, view: Array) -> Array:
        """f (..., 3) in 1/sr for unit vectors (..., 3) in a frame whose z is the normal."""
        return self.at(Configuration.of(light, view))

    @abstractmethod
    def at(self, where: Configuration) -> Array:
        """f (..., 3) in 1/sr."""


@dataclass(frozen=True)
class Configuration:
    """Pairs of directions, reduced to cosines of one shape: light, view and half vector against the
    normal (i, o, h), and light against half vector (d)."""

    cos_i: Array
    cos_o: Array
    cos_h: Array
    cos_d: Array

    @classmethod
    def around(cls, normal: Array, light: Array, view: Array) -> Configuration:
        """From unit vectors (..., 3) in any common frame."""
        half = light + view
        half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-12)
        cosines = [np.sum(a * b, axis=-1) for a, b in
                   ((normal, light), (normal, view), (normal, half), (light, half))]  # fmt: skip
        return cls(*np.broadcast_arrays(*cosines))

    @classmethod
    def of(cls, light: Array, view: Array) -> Configuration:
        """From unit vectors (..., 3) in a frame whose z is the normal."""
        light, view = np.broadcast_arrays(light, view)
        half = light + view
        half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-12)
        cos_d = np.einsum("...i,...i->...", light, half)
        # copies: the last bits of some functions of a strided array depend on where in memory NumPy
        # puts the result (a part beyond the array's end counts as overlap with it)
        cos_i, cos_o, cos_h = (np.ascontiguousarray(v[..., 2]) for v in (light, view, half))
        return cls(cos_i, cos_o, cos_h, cos_d)

    def followed_by(self, other: Configuration) -> Configuration:
        """Both sets of directions, one after the other."""
        return Configuration(
            *(
                np.concatenate([getattr(part, name) for part in (self, other)])
                for name in ("cos_i", "cos_o", "cos_h", "cos_d")
            )
        )

    @property
    def cos_io(self) -> Array:
        """Light against view."""
        return 2.0 * self.cos_d**2 - 1.0

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """Whether light and view are both above the horizon."""
        return (self.cos_i > 0) & (self.cos_o > 0)

    def ggx(self, roughness: float) -> Array:
        """D·G₂/(4 cosθi cosθo) of the GGX distribution with α = roughness²."""
        alpha2 = roughness**4
        h2 = np.minimum(self.cos_h**2, 1.0)
        d = alpha2 / (np.pi * (1.0 - h2 + alpha2 * h2) ** 2)
        i, o = np.maximum(self.cos_i, 1e-6), np.maximum(self.cos_o, 1e-6)
        smith = 1.0 + _lambda(alpha2, i) + _lambda(alpha2, o)
        return d / (4.0 * i * o * smith)


def _lambda(alpha2: float, cos: Array) -> Array:
    """Smith's Λ for GGX (Heitz 2014, equation 72)."""
    return 0.5 * (np.sqrt(1.0 + alpha2 * np.maximum(1.0 / cos**2 - 1.0, 0.0)) - 1.0)
