"""Bound on the accuracy of Blender's Principled BSDF.

An oracle, not a material: every input that changes an opaque isotropic surface is free, with the
coat's IOR and tint and the sheen, which the fits leave out because no export carries them. It is
fitted to the very pictures with which the result is compared, from several starts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from patina.core.appearance.layer_albedo import ior_from_f0
from patina.core.appearance.layered_model import Configuration
from patina.core.appearance.principled import MIN_ROUGHNESS, Principled
from patina.core.appearance.principled_fit import BLENDER
from patina.core.appearance.random_light import encoded
from patina.core.appearance.sheen import MIN_SHEEN_ROUGHNESS, sheen

from .sphere_light import lit
from .spheres import whites

Array = NDArray[np.floating]

# unknowns: the twelve of principled_fit.py; coat: reflectance at normal incidence and tint (square
# roots); sheen: weight, roughness, tint (square root)
COAT_F0, COAT_TINT, SHEEN, SHEEN_ROUGHNESS, SHEEN_TINT = (
    12,
    slice(13, 16),
    16,
    17,
    slice(18, 21),
)
LOWER, UPPER = np.zeros(21), np.ones(21)
LOWER[[4, 11]], LOWER[SHEEN_ROUGHNESS], LOWER[COAT_F0] = MIN_ROUGHNESS, MIN_SHEEN_ROUGHNESS, 0.05
LOWER[COAT_TINT] = 0.03
UPPER[5], UPPER[COAT_F0] = 0.8, 0.7
STARTS = 4  # random, beside the fitted Principled with a weak and a strong coat
PIXELS = 40  # of the disc that the search uses, evenly
FIRST_EVALUATIONS, MAX_EVALUATIONS = 10, 40  # from every start, and of the best two


def best_pictures(
    truth: NDArray[np.float32], fitted: Principled, seed: int = 0
) -> NDArray[np.float32]:
    """Return the pictures (worlds, p, 3) of the inputs that come closest to the true ones. fitted:
    the Principled BSDF of the fit, one of the starts."""
    rng = np.random.default_rng(seed)
    pixels = np.linspace(0, truth.shape[1] - 1, PIXELS).astype(int)
    some, white = lit().subset(pixels), np.array(whites(truth))[:, None, None]
    target = encoded(truth[:, pixels] / white)[0]

    def residual(x: Array) -> Array:
        shown = some.model(partial(reflectance, x))
        return np.asarray((encoded(shown / white)[0] - target).ravel())

    def error(x: Array) -> float:
        return float(np.sum(residual(x) ** 2))

    anywhere = (LOWER + (UPPER - LOWER) * rng.random(21) for _ in range(STARTS))
    starts = [_start(fitted, 0.05), _start(fitted, 0.5), *anywhere]
    found = sorted((_search(residual, x, FIRST_EVALUATIONS) for x in starts), key=error)
    best = min((_search(residual, x, MAX_EVALUATIONS) for x in found[:2]), key=error)
    return lit().model(partial(reflectance, best))


def reflectance(x: Array, where: Configuration) -> Array:
    """Return f (n, 3) in 1/sr: sheen, as in Cycles above all other layers, over the rest."""
    base = replace(
        BLENDER.principled(x),
        coat_ior=ior_from_f0(float(x[COAT_F0]) ** 2),
        coat_tint=x[COAT_TINT] ** 2,
    )
    f, albedo = sheen(where, float(x[SHEEN_ROUGHNESS]))
    color = x[SHEEN] * x[SHEEN_TINT] ** 2
    below = np.clip(1.0 - color.max() * albedo, 0.0, 1.0)[..., None]
    return np.where(where.seen[..., None], f[..., None] * color, 0.0) + below * base.at(where)


def _start(fitted: Principled, coat: float) -> Array:
    """Return the unknowns of a fitted Principled BSDF, with at least this weight of the coat."""
    x = np.zeros(21)
    x[:3], x[3], x[4] = np.sqrt(fitted.base_color), fitted.metallic, fitted.roughness
    x[5], x[6], x[7:10] = (
        np.sqrt(fitted.dielectric_f0),
        fitted.diffuse_roughness,
        fitted.specular_tint,
    )
    x[10] = max(fitted.coat_weight, coat)
    x[11] = fitted.coat_roughness if fitted.coat_weight > 0 else max(0.4 * fitted.roughness, 0.05)
    x[COAT_F0], x[COAT_TINT] = 0.3, 1.0
    x[SHEEN], x[SHEEN_ROUGHNESS], x[SHEEN_TINT] = 0.05, 0.5, 0.8
    return x


def _search(residual: Callable[[Array], Array], start: Array, evaluations: int) -> Array:
    """Return the unknowns after a number of evaluations of the derivatives."""
    margin = 1e-3 * (UPPER - LOWER)
    found = least_squares(
        residual,
        np.clip(start, LOWER + margin, UPPER - margin),
        bounds=(LOWER, UPPER),
        diff_step=1e-4,
        max_nfev=evaluations,
    )
    return np.asarray(found.x)
