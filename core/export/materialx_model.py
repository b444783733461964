"""A lobe stack as the shaders of MaterialX show it.

MaterialX 1.39, `generalized_schlick_bsdf` and `layer` of its GLSL library: each lobe is multiplied
by Turquin's compensation for multiple scattering between facets (2019, "Practical multiple
scattering compensation for microfacet models", equations 14 and 16), and the layers below are
multiplied by 1 − the channel MEAN of its directional albedo. Blender has neither, so a stack that
was fitted for Blender looks slightly different in MaterialX.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, light_view
from ..appearance.layered_model import Configuration
from ..appearance.lobe_stack import LobeStack, albedo_fit, blended
from ..appearance.oren_nayar import oren_nayar

Array = NDArray[np.floating]


def evaluate(stack: LobeStack, angles: Angles) -> Array:
    """f (..., 3) in 1/sr at half/difference angles (radians) of any shape."""
    return at(stack, Configuration.of(*light_view(*angles)))


def at(stack: LobeStack, where: Configuration) -> Array:
    """f (..., 3) in 1/sr."""
    total = np.zeros((*where.cos_i.shape, 3))
    below = np.ones((*where.cos_i.shape, 1))
    for lobe in stack.lobes:
        fresnel = lobe.fresnel(where.cos_d, where.cos_o)
        at_0, at_90 = albedo_fit(where.cos_o, lobe.roughness**2)
        single = np.maximum(at_0 + at_90, 1e-6)[..., None]
        more = 1.0 + fresnel * (1.0 - single) / single
        total += below * where.ggx(lobe.roughness)[..., None] * fresnel * more
        reflected = (lobe.albedo(where.cos_o) * more).mean(axis=-1, keepdims=True)
        below = below * (1.0 - reflected)
    color = blended(where.cos_o, stack.diffuse, stack.diffuse_mid, stack.diffuse_edge)
    base = oren_nayar(
        color,
        stack.diffuse_roughness,
        where.cos_i,
        where.cos_o,
        where.cos_io,
        as_materialx=True,
    )
    return np.where(where.seen[..., None], total + below * base, 0.0)
