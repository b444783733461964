"""The sheen of cloth and dust of Zeltner, Burley and Chiang 2022 ("Practical Multiple-Scattering
Sheen Using Linearly Transformed Cosines"), with the rational fits of MaterialX 1.39
(`mx_zeltner_sheen_brdf`). It is the fuzz of OpenPBR."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .layered_model import Configuration

Array = NDArray[np.floating]

MIN_SHEEN_ROUGHNESS = 0.01  # MaterialX uses no smaller one


def sheen(where: Configuration, roughness: float) -> tuple[Array, Array]:
    """(f in 1/sr, directional albedo towards the viewer) of a white sheen, each in the shape of the
    configuration's cosines. The albedo is that of MaterialX's fit and multiplies f."""
    y = float(np.clip(roughness, MIN_SHEEN_ROUGHNESS, 1.0))
    x = np.clip(where.cos_o, 1e-6, 1.0)
    scale = (2.58126 * x + 0.813703 * y) * y / (1.0 + 0.310327 * x**2 + 2.60994 * x * y)
    skew = np.sqrt(1.0 - x) * (y - 1.0) * y**3
    skew = skew / (0.0000254053 + 1.71228 * x - 1.71506 * x * y + 1.34174 * y**2)
    # the light in a frame whose x axis points towards the viewer
    z = np.clip(where.cos_i, 1e-6, 1.0)
    sin_o = np.sqrt(np.maximum(1.0 - x**2, 1e-12))
    across = (where.cos_io - z * x) / sin_o
    aside2 = np.maximum(1.0 - z**2 - across**2, 0.0)
    length2 = (scale * across + skew * z) ** 2 + scale**2 * aside2 + z**2
    albedo = sheen_albedo(x, y)
    # the density of the light includes its cosine, which divides out of z · (…)² / π
    return albedo / np.pi * (scale / length2) ** 2, albedo


def sheen_albedo(cos: Array, roughness: float) -> Array:
    """Directional albedo in [0, 1], in the shape of cos (MaterialX's `mx_zeltner_sheen_dir_albedo`,
    a Gaussian in cos)."""
    y = float(np.clip(roughness, MIN_SHEEN_ROUGHNESS, 1.0))
    width = y * (0.0206607 + 1.58491 * y) / (0.0379424 + y * (1.32227 + y))
    mean = y * (-0.193854 + y * (-1.14885 + y * (1.7932 - 0.95943 * y * y))) / (0.046391 + y)
    offset = y * (0.000654023 + (-0.0207818 + 0.119681 * y) * y) / (1.26264 + y * (-1.92021 + y))
    bell = np.exp(-0.5 * ((cos - mean) / width) ** 2) / (width * np.sqrt(2.0 * np.pi))
    return np.clip(bell + offset, 0.0, 1.0)
