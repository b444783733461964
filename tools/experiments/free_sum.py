"""Bound on the accuracy of any sum of Blender's isotropic closures.

An oracle, not a material: two diffuse closures, eight GGX lobes and five Beckmann lobes, each lobe
with and without Schlick's Fresnel factor. A node group cannot know where the light is, so the
weight of a closure can only depend on the view. Here each weight is a free function of the view
angle, separate for every channel, without layering, energy conservation or an order of F0 and F90.
The weights are fitted to the very pictures with which the result is then compared.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from patina.core.appearance.layered_model import Configuration
from patina.core.appearance.lobe_stack import Lobe
from patina.core.appearance.oren_nayar import oren_nayar
from patina.core.appearance.random_light import encoded

from .sphere_light import lit
from .spheres import whites

Array = NDArray[np.floating]

DIFFUSE = (0.0, 1.0)  # roughness of the diffuse closures
GGX = (0.06, 0.1, 0.16, 0.25, 0.36, 0.5, 0.7, 0.95)  # roughness of the lobes
BECKMANN = (0.1, 0.2, 0.35, 0.55, 0.85)
DEGREE = 4  # of the weights, polynomials in 1 − cosθ of the view
MAX_EVALUATIONS = 40


def best_pictures(truth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the sum's pictures (worlds, p, 3) closest to the true ones, as in Lit.model."""
    white = np.array(whites(truth), np.float32)
    found = np.empty_like(truth)
    for c in range(3):
        light = (columns()[..., c] / white[:, None, None]).reshape(-1, columns().shape[2])
        target = encoded((truth[..., c] / white[:, None]).ravel())[0]
        weights = _weights(light, target)
        found[..., c] = (light @ weights).reshape(truth.shape[:2]) * white[:, None]
    return found


@lru_cache(maxsize=1)
def columns() -> NDArray[np.float32]:
    """Return the pictures (worlds, p, k, 3) for weights of 1, one after the other."""
    return lit().columns(terms)


def terms(where: Configuration) -> Array:
    """Return the reflectance (n, k) for weights of 1: each closure times the Bernstein polynomials
    of the view angle."""
    fresnel = np.clip(1 - where.cos_d, 0, 1) ** Lobe.exponent
    shapes = [
        oren_nayar(np.ones(3), rough, where.cos_i, where.cos_o, where.cos_io)[:, 0]
        for rough in DIFFUSE
    ]
    for lobe in [where.ggx(rough) for rough in GGX] + [beckmann(where, r) for r in BECKMANN]:
        shapes += [lobe, lobe * fresnel]
    x = 1 - np.clip(where.cos_o, 0, 1)
    curves = [comb(DEGREE, i) * x**i * (1 - x) ** (DEGREE - i) for i in range(DEGREE + 1)]
    return np.stack([shape * curve for shape in shapes for curve in curves], axis=1)


def beckmann(where: Configuration, roughness: float) -> Array:
    """Return D·G₂/(4 cosθi cosθo) of the Beckmann distribution with α = roughness², with Walter's
    rational approximation of Smith's Λ (Walter et al. 2007)."""
    alpha = roughness**2
    h2 = np.clip(where.cos_h**2, 1e-12, 1.0)
    d = np.exp(-(1.0 - h2) / h2 / alpha**2) / (np.pi * alpha**2 * h2**2)
    i, o = np.maximum(where.cos_i, 1e-6), np.maximum(where.cos_o, 1e-6)
    return np.asarray(d / (4.0 * i * o * (1.0 + _lambda(alpha, i) + _lambda(alpha, o))))


def _lambda(alpha: float, cos: Array) -> Array:
    a = cos / (alpha * np.sqrt(np.maximum(1.0 - cos**2, 1e-12)))
    rational = (1.0 - 1.259 * a + 0.396 * a**2) / (3.535 * a + 2.181 * a**2)
    return np.where(a < 1.6, rational, 0.0)


def _weights(light: Array, observed: Array) -> Array:
    """Return weights (k,) ≥ 0 that minimise Σ(encoded(light @ weights) − observed)²."""
    linear = np.where(observed <= 0.04045, observed / 12.92, ((observed + 0.055) / 1.055) ** 2.4)
    slope = encoded(0.999 * linear)[1]
    kept = observed < 0.9999
    start, _ = nnls(light[kept] * slope[kept, None], linear[kept] * slope[kept], maxiter=3000)

    def jacobian(root: Array) -> Array:
        return encoded(light @ root**2)[1][:, None] * light * (2 * root)

    found = least_squares(
        lambda root: encoded(light @ root**2)[0] - observed,
        np.sqrt(start) + 1e-3,
        jac=jacobian,
        max_nfev=MAX_EVALUATIONS,
    )
    return np.asarray(found.x**2)
