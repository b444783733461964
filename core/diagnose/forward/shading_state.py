"""Surface and light at every pixel of a diagnosis, which effects change."""

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
    (n,) fraction of the light that arrives. stretch: (n,) increase of ln tan θh by anisotropic
    reflection; None: the surface is isotropic. albedo: (n, 3) factor of the reflectance of light
    from all directions, relative to the material's BRDF; None: 1."""

    pixels: Pixels
    normal: Array
    light: Array
    irradiance: Array
    visible: Array
    stretch: Array | None = None
    albedo: Array | None = None

    @classmethod
    def of(cls, pixels: Pixels) -> ShadingState:
        """The state without effects."""
        return cls(pixels, pixels.normal, pixels.light, pixels.irradiance, pixels.visible)

    def select(self, rows: NDArray[np.intp], pixels: Pixels) -> ShadingState:
        """The state at some pixels. rows: their indices; pixels: the same pixels."""
        return ShadingState(
            pixels, self.normal[rows], self.light[rows], self.irradiance[rows], self.visible[rows],
            None if self.stretch is None else self.stretch[rows],
            None if self.albedo is None else self.albedo[rows],
        )  # fmt: skip

    @property
    def differs_from_capture(self) -> bool:
        """Whether a normal, light direction or stretch differs from the capture's."""
        same = self.normal is self.pixels.normal and self.light is self.pixels.light
        return not same or self.stretch is not None

    @property
    def cos_i(self) -> Array:
        """(n,) cosine of the angle of incidence, at least 0."""
        return np.maximum(dot(self.normal, self.light), 0)

    @cached_property
    def angles(self) -> Angles:
        """Of every pixel, radians; undefined below the horizon."""
        found = half_difference(self.normal, self.light, self.pixels.view)
        if self.stretch is None:
            return found
        theta_h = np.arctan(np.tan(np.minimum(found.theta_h, 1.57)) * np.exp(self.stretch))
        return Angles(theta_h.astype(np.float32), found.theta_d, found.phi_d)

    @property
    def received(self) -> Array:
        """(n, 3) irradiance on the surface."""
        return self.irradiance * (self.cos_i * self.visible)[:, None]
