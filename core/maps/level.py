"""The fitted BRDF of a material at the angles of a sample: diffuse body, specular part, errors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import PrincipalBRDF
from ..varying.split import BodySplit, split_body

Array = NDArray[np.floating]

# radians: no scan has more accurate normals, and texels lie between its vertices
MIN_NORMAL_ERROR = np.radians(0.5)
STRETCH = 1.1  # factor of tan θh in the finite difference by ln α


class Parts(NamedTuple):
    """Values at n directions. body, specular: (n, 3) in 1/sr; slope: (n,) change of the mean
    reflectance for one standard error of the normals; gloss: (n,) derivative of the mean specular
    reflectance by ln α."""

    body: Array
    specular: Array
    slope: Array
    gloss: Array


@dataclass(frozen=True)
class MaterialLevel:
    """A fitted material. scale: factor of the photos' reflectance in the fit (1 where irradiance is
    known). normal_error: standard error of the normals, radians along each tangent."""

    name: str
    brdf: PrincipalBRDF
    split: BodySplit
    scale: float
    normal_error: float

    @property
    def channels(self) -> NDArray[np.float32]:
        """(3,) weight of each channel in estimating the body's scale, sum 1: proportional to the
        body's reflectance, since a dark channel contains little information."""
        if self.split.whole:
            return np.full(3, 1 / 3, np.float32)
        return np.asarray(self.split.body / self.split.body.sum(), np.float32)

    @property
    def trust(self) -> NDArray[np.float32]:
        """(3,) factor 0 … 1 of the weight of each channel's scale: errors of the highlight are the
        same in all channels, so they matter more in a channel with a darker body."""
        return np.minimum(1.0, (3 * self.channels) ** 2).astype(np.float32)

    @classmethod
    def of(
        cls, name: str, brdf: PrincipalBRDF, scale: float = 1.0, normal_deviation: float = 0.0
    ) -> MaterialLevel:
        """normal_deviation: standard deviation of the normals in degrees, from the fit."""
        error = max(float(np.radians(normal_deviation)), MIN_NORMAL_ERROR)
        return cls(name, brdf, split_body(brdf.evaluate), scale, error)

    @property
    def divided(self) -> MaterialLevel:
        """The same, with a specular part that is scaled apart from the body."""
        return replace(self, split=self.split.divided)

    def at(self, angles: Angles) -> Parts:
        """Body and specular part at n directions.

        A GGX or Beckmann distribution depends on tan θh / α and has 1/α² before it (Heitz 2014,
        section 5.3: stretch invariance). A surface k times as rough therefore has the specular part
        ρs(θh') / k², tan θh' = tan θh / k. The derivative at k = 1 is a finite difference with
        k = STRETCH.
        """
        rho = self.brdf.evaluate(angles)
        body, specular = self.split.parts(rho)
        grey = rho.mean(axis=1)
        towards = self._grey(angles, angles.theta_h - self.normal_error)
        away = self._grey(angles, angles.theta_h + self.normal_error)
        slope = np.maximum(np.abs(towards - grey), np.abs(grey - away))
        shine = grey if self.split.whole else specular.mean(axis=1)
        rougher = self._grey(angles, np.arctan(np.tan(angles.theta_h) / STRETCH))
        if not self.split.whole:
            rougher = np.maximum(rougher - body.mean(axis=1), 0.0)
        return Parts(body, specular, slope, (rougher / STRETCH**2 - shine) / np.log(STRETCH))

    def _grey(self, angles: Angles, theta_h: Array) -> Array:
        """(n,) channel mean of the reflectance at other angles θh (n,), clipped to 0 … 90°."""
        turned = np.clip(theta_h, 0.0, 0.5 * np.pi - 1e-3).astype(np.float32)
        found: Array = self.brdf.evaluate(Angles(turned, angles.theta_d, angles.phi_d)).mean(axis=1)
        return found
