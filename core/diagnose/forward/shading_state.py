"""What surface and light do at every pixel of a diagnosis, as effects change it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, half_difference
from ...angles.vectors import dot
from .pixels import Pixels

Array = NDArray[np.floating]


@dataclass(frozen=True)
class ShadingState:
    """At n pixels. normal, light: (n, 3) unit. irradiance: (n, 3) at normal incidence. visible:
    (n,) part of the light that arrives. stretch: (n,) what ln tan θh grows by where the surface
    reflects along one direction more widely than across it. None: nowhere."""

    pixels: Pixels
    normal: Array
    light: Array
    irradiance: Array
    visible: Array
    stretch: Array | None = None

    @classmethod
    def of(cls, pixels: Pixels) -> ShadingState:
        """As the capture says."""
        return cls(pixels, pixels.normal, pixels.light, pixels.irradiance, pixels.visible)

    def select(self, rows: NDArray[np.intp], pixels: Pixels) -> ShadingState:
        """At some of the pixels, which are given too."""
        return ShadingState(
            pixels, self.normal[rows], self.light[rows], self.irradiance[rows], self.visible[rows],
            None if self.stretch is None else self.stretch[rows],
        )  # fmt: skip

    @property
    def differs_from_capture(self) -> bool:
        """Whether any direction is another one than the capture says."""
        told = self.normal is self.pixels.normal and self.light is self.pixels.light
        return not told or self.stretch is not None

    @property
    def cos_i(self) -> Array:
        """(n,) never below 0."""
        return np.maximum(dot(self.normal, self.light), 0)

    @cached_property
    def angles(self) -> Angles:
        """Of every pixel, radians; below the horizon they mean nothing."""
        found = half_difference(self.normal, self.light, self.pixels.view)
        if self.stretch is None:
            return found
        theta_h = np.arctan(np.tan(np.minimum(found.theta_h, 1.57)) * np.exp(self.stretch))
        return Angles(theta_h.astype(np.float32), found.theta_d, found.phi_d)

    @property
    def received(self) -> Array:
        """(n, 3) irradiance on the surface."""
        return self.irradiance * (self.cos_i * self.visible)[:, None]
