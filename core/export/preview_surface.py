"""What a viewer shows of a UsdPreviewSurface, as Blender's USD exporter fills it.

Pixar, "UsdPreviewSurface Specification" (2.6): metallic workflow, f0 from ior; with metallic 1,
f0 is the colour and so is f90; in between they are interpolated. GGX with α = roughness², Schlick's
Fresnel; the clear coat is white and of the same ior. There is no place for a specular level or
tint, sheen, anisotropy, diffuse roughness, or a coat of another index.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, light_view
from ..appearance.layer_albedo import f0_from_ior
from ..appearance.principled import Configuration, Principled

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
    """f (..., 3) in 1/sr of what the exported file says, by the specification's formulas."""
    where = Configuration.of(*light_view(*angles))
    color = np.clip(np.asarray(principled.base_color, float), 0, 1)
    metallic = principled.metallic
    s5 = np.clip(1.0 - where.cos_d, 0.0, 1.0)[..., None] ** 5
    plain = f0_from_ior(principled.ior)
    f0 = (1.0 - metallic) * plain + metallic * color
    f90 = (1.0 - metallic) + metallic * color
    fresnel = f0 + (f90 - f0) * s5
    diffuse = (1.0 - metallic) * (1.0 - fresnel) * color / np.pi
    base = diffuse + fresnel * where.ggx(principled.roughness)[..., None]
    if principled.coat_weight > 0:
        coated = principled.coat_weight * (plain + (1.0 - plain) * s5)
        coat = where.ggx(principled.coat_roughness)[..., None]
        base = (1.0 - coated) * base + coated * coat
    return np.where(where.seen[..., None], base, 0.0)
