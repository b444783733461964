"""OpenPBR Surface 1.1 as a BRDF, as MaterialX 1.39 defines it by a graph of its standard nodes.

Layers from the top: fuzz (sheen), coat (dielectric GGX), then metal (GGX with F82 tint) mixed with
a dielectric of GGX over Oren–Nayar. Every GGX lobe has Turquin's compensation for multiple
scattering (2019, equations 14 and 16), and a rough coat makes the lobes below it rougher. Every
layer attenuates those below by 1 − its albedo towards the viewer. Not modelled: transmission,
subsurface, thin film, anisotropy. tests/browser/test_materialx.py compares it with the shader that
MaterialX generates.

Blender's Principled BSDF differs in the compensation, the roughening, the albedo of the layers and
the Fresnel term of its dielectric.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..layer_albedo import f0_from_ior, fresnel_dielectric, ior_from_f0
from ..layered_model import Configuration, LayeredModel
from ..lobe_stack import albedo_fit
from ..oren_nayar import oren_nayar
from ..principled import f82_fresnel
from ..sheen import sheen

Array = NDArray[np.floating]


@dataclass(frozen=True)
class OpenPBR(LayeredModel):
    """Inputs of MaterialX's `open_pbr_surface`, by their names there. Colours: (3,) linear RGB;
    weights, metalness and roughnesses in [0, 1]; specular_weight ≥ 0 multiplies the reflectance at
    normal incidence of the dielectric."""

    base_color: Array = field(default_factory=lambda: np.full(3, 0.8))
    base_diffuse_roughness: float = 0.0
    base_metalness: float = 0.0
    specular_weight: float = 1.0
    specular_color: Array = field(default_factory=lambda: np.ones(3))
    specular_roughness: float = 0.3
    specular_ior: float = 1.5
    coat_weight: float = 0.0
    coat_color: Array = field(default_factory=lambda: np.ones(3))
    coat_roughness: float = 0.0
    coat_ior: float = 1.6
    coat_darkening: float = 1.0
    fuzz_weight: float = 0.0
    fuzz_color: Array = field(default_factory=lambda: np.ones(3))
    fuzz_roughness: float = 0.5

    def at(self, where: Configuration) -> Array:
        """f (..., 3) in 1/sr."""
        total = np.zeros((*where.cos_i.shape, 3))
        below = np.ones((*where.cos_i.shape, 1))  # transmission of the layers above
        if self.fuzz_weight > 0:
            f, albedo = sheen(where, self.fuzz_roughness)
            total += (self.fuzz_weight * f)[..., None] * np.asarray(self.fuzz_color, float)
            below = below * (1.0 - self.fuzz_weight * albedo)[..., None]
        if self.coat_weight > 0:
            f, albedo = _dielectric_lobe(where, self.coat_roughness, self.coat_ior)
            total += below * (self.coat_weight * f)[..., None]
            below = below * (1.0 - self.coat_weight * albedo)[..., None] * self._coat_absorption()
        base = np.zeros_like(total)
        if self.base_metalness > 0:
            base += self.base_metalness * self._metal(where)
        if self.base_metalness < 1:
            base += (1.0 - self.base_metalness) * self._dielectric(where)
        return np.where(where.seen[..., None], total + below * base, 0.0)

    @property
    def effective_roughness(self) -> float:
        """Roughness of the lobes below the coat."""
        coated = min(self.specular_roughness**4 + 2.0 * self.coat_roughness**4, 1.0) ** 0.25
        return self.specular_roughness + self.coat_weight * (coated - self.specular_roughness)

    @property
    def dielectric_ior(self) -> float:
        """Index of refraction of the dielectric base, relative to the coat, with the specular
        weight in it."""
        ratio = self.specular_ior / self.coat_ior
        below_coat = ratio if ratio > 1.0 else 1.0 / ratio  # no total internal reflection
        eta = self.specular_ior + self.coat_weight * (below_coat - self.specular_ior)
        return ior_from_f0(float(np.clip(self.specular_weight * f0_from_ior(eta), 0.0, 0.99)))

    def _coat_absorption(self) -> Array:
        """Factor (3,) of the light from below the coat: its colour, and the darkening by internal
        reflections."""
        inside = 1.0 - (1.0 - f0_from_ior(self.coat_ior)) / self.coat_ior**2
        color = np.asarray(self.base_color, float)
        metal = color * self.specular_weight
        albedo = color + self.base_metalness * (metal - color)
        dark = (1.0 - inside) / (1.0 - albedo * inside)
        darkening = 1.0 + self.coat_weight * self.coat_darkening * (dark - 1.0)
        tint = 1.0 + self.coat_weight * (np.asarray(self.coat_color, float) - 1.0)
        return np.asarray(darkening * tint)

    def _metal(self, where: Configuration) -> Array:
        fresnel = f82_fresnel(
            where.cos_d, np.asarray(self.base_color, float), np.asarray(self.specular_color, float)
        )
        rough = self.effective_roughness
        single = _single_albedo(where.cos_o, rough)[..., None]
        lobe = (self.specular_weight * where.ggx(rough))[..., None]
        return lobe * fresnel * (1.0 + fresnel * (1.0 - single) / single)

    def _dielectric(self, where: Configuration) -> Array:
        diffuse = oren_nayar(
            np.asarray(self.base_color, float),
            self.base_diffuse_roughness,
            where.cos_i,
            where.cos_o,
            where.cos_io,
            as_materialx=True,
        )
        f, albedo = _dielectric_lobe(where, self.effective_roughness, self.dielectric_ior)
        tint = np.asarray(self.specular_color, float)
        return f[..., None] * tint + (1.0 - albedo)[..., None] * diffuse


def _dielectric_lobe(where: Configuration, roughness: float, ior: float) -> tuple[Array, Array]:
    """(f in 1/sr, directional albedo towards the viewer) of MaterialX's `dielectric_bsdf`."""
    fresnel = fresnel_dielectric(where.cos_d, ior)
    single = _single_albedo(where.cos_o, roughness)
    more = 1.0 + fresnel * (1.0 - single) / single
    at_0, at_90 = albedo_fit(where.cos_o, roughness**2)
    albedo = (f0_from_ior(ior) * at_0 + at_90) * more
    return where.ggx(roughness) * fresnel * more, albedo


def _single_albedo(cos_o: Array, roughness: float) -> Array:
    """Directional albedo by single scattering of a lobe that reflects everything."""
    at_0, at_90 = albedo_fit(cos_o, roughness**2)
    return np.maximum(at_0 + at_90, 1e-6)
