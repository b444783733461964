"""The Principled BSDF that is used with a base-colour map.

A map of the diffuse part must not change the colour of the highlight. A Principled BSDF that is
partly metallic can approximate a BRDF as well as a dielectric one, but its highlight takes the base
colour; with a map the highlight would vary too. Therefore a material of which only the diffuse body
varies gets the best-fitting Principled BSDF with metallic 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..appearance.cube_root import COARSE, Target
from ..appearance.layer_albedo import ior_from_f0
from ..appearance.principled import MIN_ROUGHNESS, Principled
from .level import MaterialLevel

Array = NDArray[np.float64]

# reflectance at normal incidence: of IOR 1.5, and the largest that is set by the Specular IOR Level
# alone (a level of 1 at IOR 1.5)
GLASS, MAX_BY_LEVEL = 0.04, 0.08
# bounds of the parameters: square roots of base colour and of that reflectance, roughness, diffuse
# roughness
LOW = np.array([0, 0, 0, 0, MIN_ROUGHNESS, 0])
HIGH = np.array([1, 1, 1, 1, 1, 1.0])


def painted_principled(level: MaterialLevel, fitted: Principled) -> Principled:
    """``fitted``, or the best-fitting dielectric if ``fitted`` is partly metallic and only the
    diffuse body varies."""
    if level.split.mostly_specular or fitted.metallic == 0:
        return fitted
    goal = Target.of(level.brdf.evaluate, COARSE)

    def residual(x: Array) -> Array:
        found: Array = np.asarray(goal.residual(_dielectric(x).at(goal.where)), np.float64)
        return found.ravel()

    body = np.sqrt(np.clip(np.pi * level.split.body, 1e-3, 0.95))
    start = [*body, np.sqrt(GLASS), np.clip(fitted.roughness, 0.06, 0.95), 0.05]
    found = least_squares(
        residual, start, bounds=(LOW, HIGH), diff_step=1e-4, xtol=1e-5, ftol=1e-6, max_nfev=60
    )
    return _dielectric(found.x)


def _dielectric(x: Array) -> Principled:
    """The Principled BSDF of a parameter vector (6,), see LOW and HIGH."""
    f0 = float(x[3]) ** 2
    by_level = f0 <= MAX_BY_LEVEL
    return Principled(
        base_color=np.clip(x[:3] ** 2, 0, 1),
        roughness=float(x[4]),
        ior=1.5 if by_level else float(ior_from_f0(f0)),
        specular_ior_level=0.5 * f0 / GLASS if by_level else 0.5,
        diffuse_roughness=float(x[5]),
    )
