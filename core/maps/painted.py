"""The Principled that a base-colour map belongs to.

A map of the diffuse part must not colour the highlight. A Principled that is partly metal, which
may come as near to a BRDF as one that is not, takes its highlight's colour from the base colour;
under a map the highlight would be painted too. So a material whose body alone varies gets the
nearest Principled without metal.
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

GLASS, MOST_BY_LEVEL = 0.04, 0.08  # reflectance at normal incidence: of IOR 1.5, by level alone
# unknowns: base colour and that reflectance (square roots), roughness, diffuse roughness
LOW = np.array([0, 0, 0, 0, MIN_ROUGHNESS, 0])
HIGH = np.array([1, 1, 1, 1, 1, 1.0])


def painted_principled(level: MaterialLevel, fitted: Principled) -> Principled:
    """``fitted``, or where it is partly metal and the body alone varies, the nearest dielectric."""
    if level.split.whole or fitted.metallic == 0:
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
    f0 = float(x[3]) ** 2
    by_level = f0 <= MOST_BY_LEVEL
    return Principled(
        base_color=np.clip(x[:3] ** 2, 0, 1),
        roughness=float(x[4]),
        ior=1.5 if by_level else float(ior_from_f0(f0)),
        specular_ior_level=0.5 * f0 / GLASS if by_level else 0.5,
        diffuse_roughness=float(x[5]),
    )
