"""Blender's Principled BSDF as a BRDF, as Cycles 4.2 to 5.x computes it with distribution 'GGX'.

Layers from the top: coat (dielectric GGX), then metal (GGX with F82 tint, Kutz et al. 2021) mixed
with a dielectric of GGX over Oren–Nayar. Every layer attenuates those below by 1 − its albedo
towards the viewer, so the model is not quite reciprocal. α = roughness², Smith's height-correlated
masking (Heitz 2014). Not modelled: transmission, subsurface, sheen, thin film, anisotropy, multiple
scattering (distribution 'MULTI_GGX').
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .layer_albedo import (
    f0_from_ior,
    fresnel_dielectric,
    ior_from_f0,
    rescaled_albedo,
    rescaled_fresnel,
)
from .layered_model import Configuration, LayeredModel
from .oren_nayar import oren_nayar

Array = NDArray[np.floating]
# below it Cycles 4.2 treats the lobe as a mirror and does not evaluate it (its test: α² > 5e-7)
MIN_ROUGHNESS = 0.03


@dataclass(frozen=True)
class Principled(LayeredModel):
    """Inputs of the Principled BSDF node, named as its sockets.

    base_color, specular_tint, coat_tint: (3,) linear RGB. roughness, diffuse_roughness, metallic,
    coat_weight, coat_roughness in [0, 1]; with specular_ior_level 0.5 the reflectance at normal
    incidence is that of ior. Blender 4.2 has no diffuse roughness.
    """

    base_color: Array = field(default_factory=lambda: np.full(3, 0.8))
    metallic: float = 0.0
    roughness: float = 0.5
    ior: float = 1.5
    specular_ior_level: float = 0.5
    specular_tint: Array = field(default_factory=lambda: np.ones(3))
    coat_weight: float = 0.0
    coat_roughness: float = 0.03
    coat_ior: float = 1.5
    coat_tint: Array = field(default_factory=lambda: np.ones(3))
    diffuse_roughness: float = 0.0

    @property
    def dielectric_f0(self) -> float:
        """Reflectance of the dielectric at normal incidence, without its tint."""
        return f0_from_ior(self.ior) * 2.0 * self.specular_ior_level

    def at(self, where: Configuration) -> Array:
        """f (..., 3) in 1/sr."""
        total = np.zeros((*where.cos_i.shape, 3))
        below = np.ones((*where.cos_i.shape, 1))  # transmission of the layers above
        if self.coat_weight > 0:
            lobe = where.ggx(self.coat_roughness)
            fresnel = fresnel_dielectric(where.cos_d, self.coat_ior)
            total += (self.coat_weight * lobe * fresnel)[..., None]
            f0 = f0_from_ior(self.coat_ior)
            s = rescaled_albedo(self.coat_roughness, where.cos_o, self.coat_ior)
            dark = np.clip(1.0 - self.coat_weight * (f0 + (1.0 - f0) * s), 0.0, 1.0)
            below = below * dark[..., None] * self._through_coat(where.cos_o)
        lobe = where.ggx(self.roughness)
        tint = np.asarray(self.specular_tint, float)
        if self.metallic > 0:
            fresnel_f82 = f82_fresnel(
                where.cos_d, np.clip(self.base_color, 0, 1), np.minimum(tint, 1.0)
            )
            total += self.metallic * below * lobe[..., None] * fresnel_f82
            below = below * (1.0 - self.metallic)
        if self.metallic < 1:
            total += below * self._dielectric(where, lobe, tint)
        return np.where(where.seen[..., None], total, 0.0)

    def _through_coat(self, cos_o: Array) -> Array:
        """Transmission of the coat's tint (..., 3): absorption along the refracted ray towards the
        viewer."""
        tint = np.asarray(self.coat_tint, float)
        sine2 = (1.0 - np.minimum(cos_o, 1.0) ** 2) / self.coat_ior**2
        depth = 1.0 / np.sqrt(np.maximum(1.0 - sine2, 1e-9))
        return 1.0 + self.coat_weight * (tint ** depth[..., None] - 1.0)

    def _dielectric(self, where: Configuration, lobe: Array, tint: Array) -> Array:
        """f (..., 3) in 1/sr of the specular layer over the diffuse base."""
        scalar_f0 = self.dielectric_f0
        ior = self.ior if self.specular_ior_level == 0.5 else ior_from_f0(scalar_f0)
        diffuse = oren_nayar(
            self.base_color, self.diffuse_roughness, where.cos_i, where.cos_o, where.cos_io
        )
        if ior == 1.0:  # Cycles has no specular lobe then
            return diffuse
        f0 = np.clip(scalar_f0 * tint, 0.0, 1.0)
        s = rescaled_fresnel(where.cos_d, ior)[..., None]
        specular = lobe[..., None] * (f0 + (1.0 - f0) * s)
        layer = rescaled_albedo(self.roughness, where.cos_o, ior)
        brightest = f0.max() + (1.0 - f0.max()) * layer
        return specular + np.clip(1.0 - brightest, 0.0, 1.0)[..., None] * diffuse


def f82_fresnel(cos_d: Array, f0: Array, tint: Array) -> Array:
    """F82-tint Fresnel (..., 3) of a metal (Kutz, Hašan, Edmondson 2021)."""
    s = np.clip(1.0 - cos_d, 0.0, 1.0)[..., None]
    f = 6.0 / 7.0  # cos 82° is 1/7, where the tint acts fully
    schlick82 = f0 + (1.0 - f0) * f**5
    b = schlick82 * (7.0 / f**6) * (1.0 - tint)
    return np.clip(f0 + (1.0 - f0) * s**5 - b * cos_d[..., None] * s**6, 0.0, 1.0)
