"""How much of the light a BRDF gives back, for each direction of view; and what to do above one.

A measured BRDF can reflect more than it receives: an irradiance that was guessed, or directions
near the horizon that no photo saw. Path tracing must not make light, so the material is held to
one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from .hemisphere import Hemisphere

Array = NDArray[np.floating]

CELLS = (96, 24)


def directional_albedo(evaluate: Callable[[Angles], Array], theta_o: Array) -> Array:
    """(v, 3) ∫ρ cos θi dωi of ``evaluate(angles) -> (n, 3)`` seen from each θo (radians)."""
    out = np.empty((len(theta_o), 3))
    for v, theta in enumerate(theta_o):
        sphere = Hemisphere.of(float(theta), *CELLS)
        rho = np.asarray(evaluate(sphere.angles), float)
        out[v] = (sphere.cos_i * sphere.solid) @ rho
    return out


def limit(albedo: Array) -> Array:
    """Factor ≤ 1 for each direction of view, one for all channels: hues stay."""
    return np.asarray(1.0 / np.maximum(albedo.max(axis=-1), 1.0))
