"""A stack of GGX lobes over a rough diffuse base, for BRDFs that one Principled BSDF cannot
represent.

Each lobe is a generalised Schlick on GGX with Smith's height-correlated masking, α = roughness²,
like MaterialX's `generalized_schlick_bsdf` (single scattering); the base is Cycles' Oren–Nayar. As
in Cycles, a lobe attenuates everything below it by 1 − the largest channel of its directional
albedo towards the viewer, so the stack is not quite reciprocal and never gains energy. The albedo
is MaterialX's rational fit (`mx_ggx_dir_albedo_analytic`): a formula that Blender's nodes can
evaluate, so that numpy, scene/material/lobe_group.py and MaterialX compute one model.

Measured surfaces change their colour towards the silhouette in ways that no Fresnel term follows.
So the diffuse colour and a lobe's f0 may have three values: facing the viewer, midway and at the
edge, blended over y = (1 − cosθ of the view)² by the quadratic Bernstein polynomials. MaterialX has
no such lobe; a stack with one value each is `plain`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .layered_model import Configuration, LayeredModel
from .oren_nayar import oren_nayar

Array = NDArray[np.floating]

MAX_LOBES = 3
# Rational quadratic fit in x = cosθ, y = α. Columns: numerators of the factors of f0 and f90, then
# their denominators; rows: the terms 1, x, y, xy, x², y², x²y, xy², x²y²
ALBEDO_FIT = (
    (0.1003, 0.9345, 1.0, 1.0),
    (-0.6303, -2.323, -1.765, 0.2281),
    (9.748, 2.229, 8.263, 15.94),
    (-2.038, -3.748, 11.53, -55.83),
    (29.34, 1.424, 28.96, 13.08),
    (-8.245, -0.7684, -7.507, 41.26),
    (-26.44, 1.436, -36.11, 54.9),
    (19.99, 0.2913, 15.86, 300.2),
    (-5.448, 0.6286, 33.37, -285.1),
)


@dataclass(frozen=True)
class Lobe:
    """One GGX lobe. f0, f90: (3,) linear RGB in [0, 1], f0 ≤ f90: reflectance at normal and at
    grazing incidence; roughness in [MIN_ROUGHNESS, 1]; f0_mid, f0_edge: f0 midway and at the
    silhouette (None: the same).

    exponent is always Schlick's 5, the only one that Blender's nodes support.
    """

    f0: Array
    f90: Array
    roughness: float
    f0_mid: Array | None = None
    f0_edge: Array | None = None
    exponent: ClassVar[float] = 5.0

    def fresnel(self, cos_d: Array, cos_o: Array) -> Array:
        """Generalised Schlick (..., 3) at the angle between light and half vector, for a viewer at
        cos_o."""
        s = np.clip(1.0 - cos_d, 0.0, 1.0)[..., None] ** self.exponent
        f0 = blended(cos_o, self.f0, self.f0_mid, self.f0_edge)
        return f0 + (np.asarray(self.f90, float) - f0) * s

    def albedo(self, cos: Array) -> Array:
        """Directional albedo (..., 3) for a viewer at this cosine, by the rational fit."""
        at_0, at_90 = albedo_fit(cos, self.roughness**2)
        f0 = blended(cos, self.f0, self.f0_mid, self.f0_edge)
        return f0 * at_0[..., None] + np.asarray(self.f90, float) * at_90[..., None]

    def transmission(self, cos_o: Array) -> Array:
        """The fraction (...) in [0, 1] of the light from below that passes the lobe."""
        return np.clip(1.0 - self.albedo(cos_o).max(axis=-1), 0.0, 1.0)


@dataclass(frozen=True)
class LobeStack(LayeredModel):
    """diffuse: (3,) albedo in [0, 1]; diffuse_roughness in [0, 1] as in the Diffuse BSDF; lobes:
    topmost first, at most MAX_LOBES; diffuse_mid, diffuse_edge: diffuse midway and at the
    silhouette (None: the same)."""

    diffuse: Array
    diffuse_roughness: float
    lobes: tuple[Lobe, ...]
    diffuse_mid: Array | None = None
    diffuse_edge: Array | None = None

    @property
    def plain(self) -> bool:
        """Whether no colour changes towards the silhouette, apart from the Fresnel term."""
        turned = [self.diffuse_mid, self.diffuse_edge]
        turned += [f0 for lobe in self.lobes for f0 in (lobe.f0_mid, lobe.f0_edge)]
        return all(color is None for color in turned)

    def at(self, where: Configuration) -> Array:
        """f (..., 3) in 1/sr."""
        total = np.zeros((*where.cos_i.shape, 3))
        below = np.ones(where.cos_i.shape)  # transmission of the lobes above
        for lobe in self.lobes:
            shape = below * where.ggx(lobe.roughness)
            total += shape[..., None] * lobe.fresnel(where.cos_d, where.cos_o)
            below = below * lobe.transmission(where.cos_o)
        color = blended(where.cos_o, self.diffuse, self.diffuse_mid, self.diffuse_edge)
        base = oren_nayar(color, self.diffuse_roughness, where.cos_i, where.cos_o, where.cos_io)
        return np.where(where.seen[..., None], total + below[..., None] * base, 0.0)


def blending(cos_o: Array) -> tuple[Array, Array, Array]:
    """Weights of the values facing the viewer, midway and at the edge; their sum is 1."""
    y = (1.0 - np.clip(cos_o, 0.0, 1.0)) ** 2
    return (1.0 - y) ** 2, 2.0 * y * (1.0 - y), y**2


def blended(cos_o: Array, facing: Array, mid: Array | None, edge: Array | None) -> Array:
    """Colour (..., 3) towards a viewer at cos_o (...)."""
    facing = np.asarray(facing, float)
    if mid is None and edge is None:
        return np.broadcast_to(facing, (*np.shape(cos_o), 3))
    values = facing, facing if mid is None else mid, facing if edge is None else edge
    shares = blending(cos_o)
    parts = [s[..., None] * np.asarray(v, float) for s, v in zip(shares, values, strict=True)]
    return parts[0] + parts[1] + parts[2]


def albedo_fit(cos: Array, alpha: float) -> tuple[Array, Array]:
    """Factors of f0 and f90 in a GGX lobe's directional albedo, each in the shape of cos."""
    x, y = np.clip(cos, 0.0, 1.0), float(alpha)
    one = np.ones_like(x)
    terms = np.stack([one, x, y * one, x * y, x**2, y**2 * one, x**2 * y, x * y**2, x**2 * y**2])
    a, b, c, d = np.tensordot(np.array(ALBEDO_FIT), terms, axes=(0, 0))
    return np.clip(a / c, 0.0, 1.0), np.clip(b / d, 0.0, 1.0)
