"""Lower bound on the error of a sum of a diffuse base and three GGX lobes with free weights.

An oracle for the lobe stack, not a physical material: each weight is a free function of the view
angle, separate for every channel, without layering, energy conservation or an order of F0 and F90.
A better fit of the colours of the stack cannot reduce the error below this; only other lobe shapes
can.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from patina.core.appearance.cube_root import Evaluate
from patina.core.appearance.lobe_stack import MAX_LOBES, Lobe, LobeStack
from patina.core.appearance.oren_nayar import oren_nayar
from patina.core.appearance.principled import Configuration
from patina.core.appearance.random_light import Pictures, encoded

Array = NDArray[np.floating]

DEGREE = 4  # of the weights, polynomials in 1 − cosθ of the view
MAX_EVALUATIONS = 80
EXTRA_ROUGHNESS = (2.0, 0.4)  # of lobes that the stack lacks, relative to its first lobe


@dataclass(frozen=True)
class FreeSum:
    """roughness: (MOST_LOBES,); weights: (terms · (DEGREE + 1), 3), in the order of `terms`."""

    roughness: tuple[float, ...]
    diffuse_roughness: float
    weights: Array

    @classmethod
    def fit(cls, evaluate: Evaluate, stack: LobeStack) -> FreeSum:
        """Fit the weights to pictures of ``evaluate``, with the roughness of a fitted stack."""
        found = [lobe.roughness for lobe in stack.lobes] or [0.4]
        for factor in EXTRA_ROUGHNESS:
            found.append(float(np.clip(factor * found[0], 0.05, 0.95)))
        roughness = tuple(found[:MAX_LOBES])
        pictures = Pictures.of(evaluate)
        columns = terms(pictures.where, roughness, stack.diffuse_roughness)
        light = np.concatenate([sky @ columns[part] for part, sky in pictures.parts])
        light /= pictures.white
        channels = [_weights(light, pictures.encoded[:, c]) for c in range(3)]
        return cls(roughness, stack.diffuse_roughness, np.stack(channels, axis=1))

    def at(self, where: Configuration) -> Array:
        """Return the BRDF (n, 3) in 1/sr at n configurations."""
        f = terms(where, self.roughness, self.diffuse_roughness) @ self.weights
        return np.where(where.seen[:, None], f, 0.0)


def terms(where: Configuration, roughness: tuple[float, ...], base: float) -> Array:
    """Return the reflectance (n, k) for weights of 1: the diffuse term, then for each lobe GGX and
    GGX times Schlick's Fresnel factor, each times the Bernstein polynomials of the view angle."""
    fresnel = np.clip(1 - where.cos_d, 0, 1) ** Lobe.exponent
    shapes = [oren_nayar(np.ones(3), base, where.cos_i, where.cos_o, where.cos_io)[:, 0]]
    for width in roughness:
        lobe = where.ggx(width)
        shapes += [lobe, lobe * fresnel]
    x = 1 - np.clip(where.cos_o, 0, 1)
    curves = [comb(DEGREE, i) * x**i * (1 - x) ** (DEGREE - i) for i in range(DEGREE + 1)]
    return np.stack([shape * curve for shape in shapes for curve in curves], axis=1)


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
