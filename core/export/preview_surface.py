"""A Principled BSDF as a viewer shows the UsdPreviewSurface that Blender's USD exporter writes.

Pixar, "UsdPreviewSurface Specification" (2.6): metallic workflow, f0 from ior; with metallic 1,
f0 and f90 are the colour; values in between are interpolated. GGX with α = roughness², Schlick's
Fresnel; the clear coat is white and has the same ior. Specular level and tint, sheen, anisotropy,
diffuse roughness and a coat of another index cannot be represented.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, light_view
from ..appearance.layer_albedo import f0_from_ior
from ..appearance.layered_model import Configuration
from ..appearance.principled import Principled
from ..appearance.principled_fit import Interpretation

Array = NDArray[np.floating]

DROPPED = {
    "specular_ior_level": "Specular IOR Level",
    "specular_tint": "Specular Tint",
    "diffuse_roughness": "Diffuse Roughness",
    "coat_ior": "Coat IOR",
    "coat_tint": "Coat Tint",
    "sheen_weight": "Sheen",
    "anisotropic": "Anisotropic",
}


def evaluate(principled: Principled, angles: Angles) -> Array:
    """f (..., 3) in 1/sr of the exported file at half/difference angles in radians."""
    return at(principled, Configuration.of(*light_view(*angles)))


def at(principled: Principled, where: Configuration) -> Array:
    """f (..., 3) in 1/sr of the exported file, by the formulas of the specification."""
    color = np.clip(np.asarray(principled.base_color, float), 0, 1)
    metallic = principled.metallic
    s5 = np.clip(1.0 - where.cos_d, 0.0, 1.0)[..., None] ** 5
    dielectric_f0 = f0_from_ior(principled.ior)
    f0 = (1.0 - metallic) * dielectric_f0 + metallic * color
    f90 = (1.0 - metallic) + metallic * color
    fresnel = f0 + (f90 - f0) * s5
    diffuse = (1.0 - metallic) * (1.0 - fresnel) * color / np.pi
    base = diffuse + fresnel * where.ggx(principled.roughness)[..., None]
    if principled.coat_weight > 0:
        coated = principled.coat_weight * (dielectric_f0 + (1.0 - dielectric_f0) * s5)
        coat = where.ggx(principled.coat_roughness)[..., None]
        base = (1.0 - coated) * base + coated * coat
    return np.where(where.seen[..., None], base, 0.0)


PREVIEW_SURFACE = Interpretation(
    at, diffuse_roughness=False, specular_tint=False, specular_level=False
)
