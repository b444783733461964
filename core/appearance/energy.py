"""Directional albedo of a BRDF, and a limit where it exceeds 1.

A measured BRDF can reflect more light than it receives: the irradiance was estimated, or directions
near the horizon have no samples. Path tracing must not create energy, so the material is scaled to
an albedo of at most 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from .hemisphere import Hemisphere

Array = NDArray[np.floating]

CELLS = (96, 24)  # of half vectors, over θh and φh


@dataclass(frozen=True)
class Hemispheres:
    """Directions of light for several views, one after the other.

    angles: (views · n,); weight: (views, n) cos θi times the solid angle of each direction, sr.
    """

    angles: Angles
    weight: Array

    @classmethod
    def of(cls, theta_o: Sequence[float] | Array) -> Hemispheres:
        """For views at θo (radians)."""
        spheres = [Hemisphere.of(float(theta), *CELLS) for theta in theta_o]
        parts = zip(*(sphere.angles for sphere in spheres), strict=True)
        weight = np.stack([sphere.cos_i * sphere.solid for sphere in spheres])
        return cls(Angles(*(np.concatenate(part) for part in parts)), weight)

    def albedo(self, rho: Array) -> Array:
        """(views, 3) ∫ρ cos θi dωi of ρ (views · n, 3) in 1/sr at the angles."""
        each = np.asarray(rho, float).reshape(*self.weight.shape, -1)
        return np.stack([w @ r for w, r in zip(self.weight, each, strict=True)])


def directional_albedo(evaluate: Callable[[Angles], Array], theta_o: Array) -> Array:
    """(v, 3) ∫ρ cos θi dωi of ``evaluate(angles) -> (n, 3)``, ρ in 1/sr, for each view θo (v,)
    (radians)."""
    hemispheres = Hemispheres.of(theta_o)
    return hemispheres.albedo(evaluate(hemispheres.angles))


def limit(albedo: Array) -> Array:
    """Factor ≤ 1 for each direction of view, the same for all channels, so that hues are preserved;
    albedo: (v, 3)."""
    return np.asarray(1.0 / np.maximum(albedo.max(axis=-1), 1.0))
