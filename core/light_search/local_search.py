"""Minimise the cost of one lamp over its parameters, for given materials."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ..calibrate.movable import free_light
from ..geometry import RayScene
from ..light import Light
from .brdf_dictionary import BrdfDictionary
from .flash_prior import relative_prior
from .shading import LampPixels, predicted

Array = NDArray[np.floating]

EVALUATIONS = 30  # per parameter
MIN_COST_CHANGE = 1e-5  # mean |log residual|


def cost_with_gain(pixels: LampPixels, radiance: Array, coefficients: Array) -> float:
    """The cost of materials (m, k) with the best irradiance. radiance: (n, k) of the dictionary."""
    values = predicted(radiance, coefficients, pixels.material)
    return pixels.measured.cost(pixels.measured.gain(values) * values)


def minimised_light(
    light: Light,
    stated: Light,
    reach: float,
    pixels: LampPixels,
    coefficients: Array,
    scale: float,
    rays: RayScene,
    dictionary: BrdfDictionary,
) -> Light:
    """The light with the smallest cost near ``light`` (Nelder & Mead 1965: the cost has kinks).

    stated: with the offset that a flash's prior is about (flash_prior.py). reach: median distance
    from camera to surface, scan units. scale: of the first simplex, in typical changes of the
    parameters (calibrate/movable.py).
    """
    free = free_light(light, reach)

    def cost(x: NDArray[np.float64]) -> float:
        moved = free.light(np.clip(x, free.low, free.high))
        radiance = pixels.dictionary_radiance(moved, rays, dictionary)
        prior = relative_prior(moved, stated, reach)
        return (1.0 + prior) * cost_with_gain(pixels, radiance, coefficients)

    simplex = np.vstack([free.start, free.start + scale * np.diag(free.size)])
    options = {
        "initial_simplex": simplex,
        "maxfev": EVALUATIONS * len(free.start),
        "xatol": np.inf,
        "fatol": MIN_COST_CHANGE,
    }
    found = minimize(cost, free.start, method="Nelder-Mead", options=options)
    return free.light(np.clip(found.x, free.low, free.high))
