"""How a material varies over the surface, known before the diagnosis starts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .pixels import Pixels


@dataclass(frozen=True)
class VariationAtPixels:
    """At n pixels. reflectance: (n, 3) factor of the reflectance in the directions of the capture,
    relative to the typical material. albedo: (n, 3) factor of its diffuse part, which applies to
    light from all directions. normal: (n, 3) unit, scan frame. float32."""

    reflectance: NDArray[np.float32]
    albedo: NDArray[np.float32]
    normal: NDArray[np.float32]


class KnownVariation(ABC):
    """The reflectance and the normals of all materials as functions of the place."""

    @abstractmethod
    def at(self, pixels: Pixels) -> VariationAtPixels:
        """Of the surface points that pixels show."""
