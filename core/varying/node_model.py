"""The radiance of a surface whose reflectance varies, and its derivatives.

At a node, the BRDF of the material is split into a diffuse body and a specular part (split.py)
and changed to

    ρ = exp(a) · body + exp(s + c − 2 g) · specular(θh'),   tan θh' = tan θh / exp(g)

with the normal n + t, normalised. The ten parameters of a node are a (three channels: logarithm
of the factor of the diffuse colour), s (the same of the specular part, the mean of its channels), g
(of the roughness α, with the stretch invariance of GGX and Beckmann distributions, Heitz 2014,
section 5.3), t (a vector in the scan frame; only its part along the surface matters, and a vector,
unlike two angles, can be interpolated) and two coordinates of c, the colour of the specular part:
gold and paint have highlights of different colours. All are 0 for the even material. The specular
part has the colour of a metal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference
from ..angles.vectors import tangents
from ..basis import PrincipalBRDF
from ..basis.log_table import LogTable
from .split import BodySplit, split_body

Array = NDArray[np.floating]

COUNT = 10  # parameters of a node
DIFFUSE, SPECULAR, GLOSS, TILT, TINT = slice(0, 3), 3, 4, slice(5, 8), slice(8, 10)
TINTS = (np.array([[2, -1, -1], [0, 1, -1]]) / np.sqrt([[6], [2]])).astype(np.float32)
"""(2, 3) the coordinates of TINT as logarithms of the channels: red against cyan, green against
blue. Their mean is 0."""
LIMITS = np.array([3, 3, 3, 2.5, 0.9, 0.4, 0.4, 0.4, 1.5, 1.5], np.float32)
"""Largest size of each parameter: a factor of 20 of the diffuse colour, 12 of the specular part,
2.5 of the roughness; a tilt of 22 degrees; a factor of 6 between the channels of the specular part,
as of gold."""
GLOSS_STEP, TILT_STEP = 0.1, 0.02  # of the finite differences
MIN_COSINE = 0.02  # of a tilted normal: a tilt shall not turn a lit node away from the light
MAX_THETA_H = 1.55  # radians, before the tangent


class Shading(NamedTuple):
    """Light and view at m points. light, view: (m, 3) unit, from the surface; irradiance: (m, 3) on
    a surface that faces the light. float32, scan frame."""

    light: NDArray[np.float32]
    view: NDArray[np.float32]
    irradiance: NDArray[np.float32]


@dataclass(frozen=True)
class NodeModel:
    """The BRDF of one material as its nodes need it. table, split: of the BRDF; scale: factor of
    the photos' reflectance in the fit."""

    table: LogTable
    split: BodySplit
    scale: float

    @classmethod
    def of(cls, brdf: PrincipalBRDF, scale: float = 1.0) -> NodeModel:
        """The model of a fitted material."""
        return cls(brdf.log_table, split_body(brdf.evaluate).divided, scale)

    @property
    def body(self) -> NDArray[np.float32]:
        """(3,) diffuse level in 1/sr."""
        return self.split.level.astype(np.float32)

    @property
    def mostly_specular(self) -> bool:
        """Whether the diffuse part reflects almost nothing, as that of a metal."""
        return self.split.mostly_specular

    def albedo_factor(self, parameters: Array) -> NDArray[np.float32]:
        """(m, 3) factor of the reflected light of nodes with parameters (m, 10), roughness apart:
        that of the diffuse part, unless it reflects almost nothing."""
        diffuse = diffuse_factor(parameters)
        if not self.mostly_specular:
            return diffuse
        return self.split.all_light(diffuse, specular_factor(parameters))

    @property
    def colour(self) -> tuple[int, ...]:
        """The parameters that are the colour of the surface: those of the part that reflects most
        of the light."""
        if self.mostly_specular:
            return (SPECULAR, *range(TINT.start, TINT.stop))
        return tuple(range(DIFFUSE.start, DIFFUSE.stop))

    def reflectance(self, angles: Angles, parameters: Array) -> NDArray[np.float32]:
        """(m, 3) ρ in 1/sr at angles to the tilted normals of points with parameters (m, 10)."""
        body, specular = self._parts(angles, parameters)
        return body + specular

    def radiance(self, seen: Shading, normal: Array, parameters: Array) -> NDArray[np.float32]:
        """(m, 3) radiance at points with smooth normals (m, 3)."""
        body, specular = self._lit(seen, tilted(normal, parameters), parameters)
        return body + specular

    def derivatives(
        self, seen: Shading, normal: Array, parameters: Array, free: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(radiance (m, 3), its derivatives (m, 3, 10) by the parameters). free: (10,); others get
        0, which saves time."""
        turned = tilted(normal, parameters)
        body, specular = self._lit(seen, turned, parameters)
        total = body + specular
        out = np.zeros((*total.shape, COUNT), np.float32)
        for channel in range(3):
            out[:, channel, channel] = body[:, channel]
        out[:, :, SPECULAR] = specular
        out[:, :, TINT] = specular[:, :, None] * TINTS.T
        if free[GLOSS]:
            rougher = parameters.copy()
            rougher[:, GLOSS] += GLOSS_STEP
            out[:, :, GLOSS] = (sum(self._lit(seen, turned, rougher)) - total) / GLOSS_STEP
        for way in tangents(turned) if free[TILT].any() else ():
            along = way.astype(np.float32)
            further = _unit(turned + np.float32(TILT_STEP) * along)
            change = (sum(self._lit(seen, further, parameters)) - total) / TILT_STEP
            out[:, :, TILT] += change[:, :, None] * along[:, None, :]
        return total, out

    def _lit(
        self, seen: Shading, normal: Array, parameters: Array
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Radiance (m, 3) of the diffuse and of the specular part, with normals (m, 3)."""
        cosine = np.maximum(np.einsum("ij,ij->i", normal, seen.light), MIN_COSINE)
        light = seen.irradiance * (cosine / np.float32(self.scale))[:, None]
        body, specular = self._parts(half_difference(normal, seen.light, seen.view), parameters)
        return body * light, specular * light

    def _parts(
        self, angles: Angles, parameters: Array
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        gloss = parameters[:, GLOSS]
        tangent = np.tan(np.minimum(angles.theta_h, MAX_THETA_H)) * np.exp(-gloss)
        stretched = np.arctan(tangent).astype(np.float32)
        rho = self.table.evaluate(Angles(stretched, angles.theta_d, angles.phi_d))
        spread = np.exp(-2 * gloss)[:, None]  # a rougher surface spreads the same light
        body, specular = self.split.parts(rho)
        factor = specular_factor(parameters) * spread
        return body * diffuse_factor(parameters), specular * factor


def diffuse_factor(parameters: Array) -> NDArray[np.float32]:
    """(m, 3) factor of the diffuse part of nodes with parameters (m, 10)."""
    return np.asarray(np.exp(parameters[:, DIFFUSE]), np.float32)


def specular_factor(parameters: Array) -> NDArray[np.float32]:
    """(m, 3) factor of the specular part, roughness apart, of nodes with parameters (m, 10)."""
    logarithm = parameters[:, SPECULAR, None] + parameters[:, TINT] @ TINTS
    return np.asarray(np.exp(logarithm), np.float32)


def tilted(normal: Array, parameters: Array) -> NDArray[np.float32]:
    """(m, 3) unit normals of nodes with smooth normals (m, 3) and parameters (m, 10)."""
    tilt = parameters[:, TILT]
    along = np.einsum("ij,ij->i", tilt, normal)[:, None] * normal
    return _unit(normal + tilt - along)


def _unit(v: Array) -> NDArray[np.float32]:
    size = np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(v / np.maximum(size, 1e-20), np.float32)
