"""A Principled BSDF as a glTF viewer shows it: the reference BRDF of glTF 2.0.

Khronos Group, "glTF 2.0 Specification", appendix B (metallic-roughness), and the extensions
KHR_materials_specular, KHR_materials_ior and KHR_materials_clearcoat with their own formulas.
The diffuse part is Lambertian whatever the Diffuse Roughness; the coat is colourless with index of
refraction 1.5.
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

# sockets used by the fit that Blender's exporter cannot write
DROPPED = {
    "diffuse_roughness": "Diffuse Roughness",
    "coat_ior": "Coat IOR",
    "coat_tint": "Coat Tint",
}
COAT_F0 = 0.04  # KHR_materials_clearcoat fixes the index of refraction at 1.5


def evaluate(principled: Principled, angles: Angles) -> Array:
    """f (..., 3) in 1/sr of the exported file at half/difference angles in radians."""
    return at(principled, Configuration.of(*light_view(*angles)))


def at(principled: Principled, where: Configuration) -> Array:
    """f (..., 3) in 1/sr of the exported file, by the formulas of the specification."""
    color = np.clip(np.asarray(principled.base_color, float), 0, 1)
    s5 = np.clip(1.0 - where.cos_d, 0.0, 1.0)[..., None] ** 5
    lobe = where.ggx(principled.roughness)[..., None]
    # KHR_materials_specular: the factor scales f0 and f90 and is at most 1; Blender's exporter puts
    # the rest into the specular colour
    level = 2.0 * principled.specular_ior_level
    tint = np.asarray(principled.specular_tint, float)
    factor, specular_color = (level, tint) if level <= 1 else (1.0, tint * level)
    f0 = np.minimum(f0_from_ior(principled.ior) * specular_color, 1.0) * factor
    fresnel = f0 + (factor - f0) * s5
    dielectric = (1.0 - fresnel.max(axis=-1, keepdims=True)) * color / np.pi + fresnel * lobe
    metal = (color + (1.0 - color) * s5) * lobe
    base = (1.0 - principled.metallic) * dielectric + principled.metallic * metal
    if principled.coat_weight > 0:
        at_view = COAT_F0 + (1.0 - COAT_F0) * np.clip(1.0 - where.cos_o, 0, 1)[..., None] ** 5
        coat = where.ggx(principled.coat_roughness)[..., None]
        coated = COAT_F0 + (1.0 - COAT_F0) * s5
        base = base * (1.0 - principled.coat_weight * at_view)
        base = base + principled.coat_weight * coated * coat
    return np.where(where.seen[..., None], base, 0.0)


GLTF = Interpretation(at, diffuse_roughness=False)
