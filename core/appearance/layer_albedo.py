"""The albedo by which Cycles attenuates what lies below a dielectric layer.

Blender's Principled BSDF scales its diffuse base by 1 − albedo of the specular layer, and reads
that albedo from a table of 16 × 16 × 16 numbers. With s the Fresnel reflectance rescaled so that 0
is normal incidence and 1 total reflection, the table holds the mean of s over the visible GGX
normals (Heitz 2018) whose mirror direction is above the horizon; masking of the light is neglected.
Here the mean is computed by quadrature. tests/wheel/test_principled_cycles.py compares it with
renders of Cycles.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

NODES = 16
F0_OF_GLASS = 0.04  # reflectance at normal incidence of IOR 1.5
SQUARE = 64  # points per side of the square from which visible normals are sampled


def fresnel_dielectric(cos_d: Array, ior: float) -> Array:
    """Unpolarised Fresnel reflectance at cos_d (any shape) for a relative index of refraction."""
    c = np.abs(cos_d)
    g2 = ior * ior - 1.0 + c * c
    g = np.sqrt(np.maximum(g2, 0.0))
    a = (g - c) / (g + c)
    b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return np.where(g2 > 0, 0.5 * a * a * (1.0 + b * b), 1.0)


def f0_from_ior(ior: float) -> float:
    """Reflectance at normal incidence."""
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def ior_from_f0(f0: float) -> float:
    """Index of refraction (≥ 1) with this reflectance at normal incidence, f0 < 1."""
    root = np.sqrt(np.clip(f0, 0.0, 0.99))
    return float((1.0 + root) / (1.0 - root))


def rescaled_fresnel(cos_d: Array, ior: float) -> Array:
    """s in [0, 1]: Fresnel reflectance, rescaled from its value at normal incidence (0) to total
    reflection (1)."""
    f0 = f0_from_ior(ior)
    return np.clip((fresnel_dielectric(cos_d, ior) - f0) / (1.0 - f0), 0.0, 1.0)


def rescaled_albedo(roughness: float, cos_view: Array, ior: float) -> Array:
    """s averaged over the lobe, in the shape of cos_view; the layer's albedo is f0 + (1 − f0)·s."""
    table = _table()
    z = np.sqrt(abs((ior - 1.0) / (ior + 1.0)))
    slab = _between(table, np.float64(z))  # (cos, roughness)
    row = _between(slab.T, np.float64(roughness))  # (cos,)
    return np.interp(np.clip(cos_view, 0, 1) * (NODES - 1), np.arange(NODES), row)


def _between(values: Array, at: np.float64) -> Array:
    """Linear interpolation along axis 0, with nodes evenly over [0, 1]."""
    u = np.clip(at, 0.0, 1.0) * (NODES - 1)
    low = min(int(u), NODES - 2)
    return values[low] + (u - low) * (values[low + 1] - values[low])


@lru_cache(maxsize=1)
def _table() -> NDArray[np.float64]:
    """(z, cos θ of the view, roughness), 16 nodes each on [0, 1]; z = sqrt((ior − 1)/(ior + 1))."""
    u = (np.arange(SQUARE) + 0.5) / SQUARE
    radius, phi = np.sqrt(u)[:, None], 2.0 * np.pi * u[None, :]
    disk_x, disk_y = (radius * np.cos(phi)).ravel(), (radius * np.sin(phi)).ravel()
    nodes = np.clip(np.arange(NODES) / (NODES - 1), 1e-4, 1.0)
    iors = [ior_from_f0(min(z, 0.99) ** 4) for z in nodes]
    table = np.empty((NODES, NODES, NODES))
    for r, roughness in enumerate(nodes):
        for m, mu in enumerate(nodes):
            cos_d, above = _visible_normals(mu, roughness**2, disk_x, disk_y)
            for k, ior in enumerate(iors):
                table[k, m, r] = np.mean(rescaled_fresnel(cos_d, ior) * above)
    return table


def _visible_normals(mu: float, alpha: float, x: Array, y: Array) -> tuple[Array, Array]:
    """(view · normal, whether the reflected ray is above the horizon) for visible normals sampled
    from points of the unit disk."""
    sin = np.sqrt(1.0 - mu * mu)
    length = np.hypot(alpha * sin, mu)
    side, up = alpha * sin / length, mu / length
    blend = 0.5 * (1.0 + up)
    y = (1.0 - blend) * np.sqrt(np.maximum(1.0 - x * x, 0.0)) + blend * y
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    normal = np.stack(
        [alpha * (side * z - up * y), alpha * x, np.maximum(up * z + side * y, 0.0)], axis=-1
    )
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    cos_d = sin * normal[:, 0] + mu * normal[:, 2]
    return cos_d, 2.0 * cos_d * normal[:, 2] - mu > 0
