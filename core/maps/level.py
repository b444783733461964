"""What a fit knows of a material at the angles of a sample: body, highlight, how sure they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import PrincipalBRDF
from .split import BodySplit, split_body

Array = NDArray[np.floating]

LEAST_ERROR = np.radians(0.5)  # no scan's normals are better, and texels lie between its vertices
STRETCH = 1.1  # of tan θh, for the slope of gloss


class Parts(NamedTuple):
    """At n directions: body, specular (n, 3), 1/sr; slope: (n,) how much the grey
    reflectance changes with the normals' error; gloss: (n,) derivative by ln α of its highlight."""

    body: Array
    specular: Array
    slope: Array
    gloss: Array


@dataclass(frozen=True)
class MaterialLevel:
    """A fitted material. scale: what the photos' reflectance was multiplied by (1 where irradiance
    is known). normal_error: radians along each tangent."""

    name: str
    brdf: PrincipalBRDF
    split: BodySplit
    scale: float
    normal_error: float

    @property
    def channels(self) -> NDArray[np.float32]:
        """(3,) what each channel tells of the body, sum 1: a dark one hardly anything."""
        if self.split.whole:
            return np.full(3, 1 / 3, np.float32)
        return np.asarray(self.split.body / self.split.body.sum(), np.float32)

    @property
    def trust(self) -> NDArray[np.float32]:
        """(3,) how sure each channel's scale is, as a factor of the weight of all: errors of the
        highlight are alike in all channels, and count the more the darker a channel's body is."""
        return np.minimum(1.0, (3 * self.channels) ** 2).astype(np.float32)

    @classmethod
    def of(
        cls, name: str, brdf: PrincipalBRDF, scale: float = 1.0, normal_deviation: float = 0.0
    ) -> MaterialLevel:
        """normal_deviation: degrees, as a fit tells it."""
        error = max(float(np.radians(normal_deviation)), LEAST_ERROR)
        return cls(name, brdf, split_body(brdf.evaluate), scale, error)

    def at(self, angles: Angles) -> Parts:
        """Body and highlight at directions (n,).

        A GGX or Beckmann distribution depends on tan θh / α and has 1/α² before it (Heitz 2014,
        section 5.3: stretch invariance), so a surface k times as rough has the specular part
        ρs(θh') / k², tan θh' = tan θh / k: its slope at k = 1 is taken from one k.
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
        """(n,) mean reflectance with another θh."""
        turned = np.clip(theta_h, 0.0, 0.5 * np.pi - 1e-3).astype(np.float32)
        found: Array = self.brdf.evaluate(Angles(turned, angles.theta_d, angles.phi_d)).mean(axis=1)
        return found
