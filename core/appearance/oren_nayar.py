"""The rough diffuse reflection of Cycles: Fujii's improved Oren–Nayar with multiple scattering.

Single scattering: Fujii 2012, "Improved Oren-Nayar" (A and B, no trigonometric functions). Multiple
scattering: OpenPBR's energy-preserving term, separable and reciprocal. Cycles 4.3 and later compute
this model (4.2 has no multiple scattering; EEVEE renders every diffuse surface as Lambertian), but
multiply the second term by the colour once more than MaterialX's shaders do. Tests in tests/wheel
compare it with renders, tests/browser/test_materialx.py with MaterialX.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
SMOOTH = 1e-5  # roughness below which Cycles renders a Lambertian surface


def oren_nayar(
    color: Array,
    roughness: float,
    cos_i: Array,
    cos_o: Array,
    cos_io: Array,
    as_materialx: bool = False,
) -> Array:
    """f (..., 3) in 1/sr, as Cycles or MaterialX computes it.

    color: (3,) or (..., 3) linear RGB; roughness in [0, 1]; cos_i, cos_o: light and view against
    the normal; cos_io: light against view, all of one shape (...). Undefined below the horizon.
    """
    color = np.asarray(color, float)
    if roughness < SMOOTH:
        return np.broadcast_to(color / np.pi, (*np.shape(cos_i), 3))
    sigma = min(float(roughness), 1.0)
    a = 1.0 / (np.pi + sigma * (np.pi / 2 - 2 / 3))
    b = sigma * a
    cos_i, cos_o = np.clip(cos_i, 0, 1), np.clip(cos_o, 0, 1)
    t = cos_io - cos_i * cos_o
    t = np.where(t > 0, t / np.maximum(np.maximum(cos_i, cos_o), 1e-6), t)
    mean = a * np.pi + b * (2 * np.pi - 5.6) / 3
    albedo = np.clip(color, 0, 1)
    many = albedo**2 / np.pi * (mean / (1 - mean)) / (1 - albedo * (1 - mean))
    lost = (1 - _albedo(a, b, cos_i)) * (1 - _albedo(a, b, cos_o))
    single, multiple = (a + b * t)[..., None] * color, lost[..., None] * many
    return np.asarray(single + (multiple if as_materialx else multiple * color))


def _albedo(a: float, b: float, cos: Array) -> Array:
    """Single-scattering albedo for light (or a viewer) at this cosine, of a white surface."""
    safe = np.maximum(cos, 1e-6)
    sin = np.sqrt(np.maximum(1 - safe**2, 0))
    g = sin * (np.arccos(safe) - 2 / 3 - sin * safe) + 2 / 3 * (sin / safe) * (1 - sin**3)
    return a * np.pi + b * g
