"""Distance of a reflectance model from a BRDF by a metric that predicts perceived differences.

The metric is the cosine-weighted cube root of Fores, Ferwerda, Gu 2012 ("Toward a perceptually
based metric for BRDF modeling"), which of several metrics agreed with observers; a plain L2 metric
is dominated by the peak (Bieron and Peers 2020). Directions are weighted as on the MERL grid, where
those studies were made: uniformly in sqrt(θh), θd and φd.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines, light_view
from ..errors import FitError
from .layered_model import Configuration

Array = NDArray[np.floating]
Evaluate = Callable[[Angles], Array]

MAX_THETA = np.radians(82.0)  # of light and view from the normal
# nodes of the quadrature over (θh, θd, φd), θh spaced logarithmically: 12 for a lobe of 1°
NODES = (44, 12, 8)
COARSE = (44, 6, 4)  # as fine in θh, where lobes are sharp; enough to compare starts
DARK = 1e-9  # 1/sr: below it the slope of the cube root is clamped
KNEE = np.radians(0.4)  # θh is spaced linearly below, logarithmically above


@dataclass(frozen=True)
class Target:
    """The target of a fit: directions, √weight (n, 1) and ∛(ρ cosθi) (n, 3) times √weight."""

    where: Configuration
    weight: Array
    root: Array

    @classmethod
    def of(cls, evaluate: Evaluate, nodes: tuple[int, int, int] = NODES) -> Target:
        """evaluate(angles) -> ρ (n, 3) in 1/sr. Raises FitError where the result has another shape
        or is not finite."""
        angles, weight = quadrature(nodes)
        light, view = light_view(*angles)
        rho = np.asarray(evaluate(angles), float)
        if rho.shape != (weight.size, 3) or not np.isfinite(rho).all():
            raise FitError(
                f"the BRDF returned an array of shape {rho.shape}, or values that are not finite; "
                f"expected ({weight.size}, 3)"
            )
        where = Configuration.of(light, view)
        scale = np.sqrt(weight)[:, None]
        return cls(where, scale, scale * np.cbrt(np.maximum(rho, 0) * where.cos_i[:, None]))

    def residual(self, f: Array) -> Array:
        """(n, 3) weighted difference of cube roots, ∛(f cosθi) − ∛(ρ cosθi), of a model with
        reflectance f (n, 3) in 1/sr at ``where``."""
        return self.weight * np.cbrt(f * self.where.cos_i[:, None]) - self.root

    def residual_and_slopes(self, f: Array, slopes: Array) -> tuple[Array, Array]:
        """The residual (n, 3) and its derivatives (k, n, 3) by the k parameters of the model.
        slopes: (k, n, 3) derivatives of f."""
        cosine = np.cbrt(self.where.cos_i)[:, None]
        by_f = self.weight * cosine / (3 * np.maximum(f, DARK) ** (2 / 3))
        return self.residual(f), slopes * by_f

    def error(self, f: Array) -> float:
        """Relative cube-root error ‖∛(f cosθi) − ∛(ρ cosθi)‖ / ‖∛(ρ cosθi)‖ of a model with
        reflectance f (n, 3)."""
        length = max(float(np.linalg.norm(self.root)), 1e-12)
        return float(np.linalg.norm(self.residual(f)) / length)

    def lambertian(self) -> Array:
        """Albedo (3,) of the best Lambertian surface: the problem is linear in its cube root."""
        shape = self.weight * np.cbrt(self.where.cos_i / np.pi)[:, None]
        return (np.sum(shape * self.root, axis=0) / np.sum(shape**2)) ** 3


def quadrature(nodes: tuple[int, int, int] = NODES) -> tuple[Angles, Array]:
    """Directions (n,) and weights (n,); Σ = 1 before those beyond MAX_THETA are dropped."""
    n_h, n_d, n_p = nodes
    span = np.log1p(np.pi / 2 / KNEE)
    s = (np.arange(n_h) + 0.5) / n_h
    theta_h = KNEE * np.expm1(s * span)
    # dθh = (θh + knee)·span ds, and the MERL grid has dθh / sqrt(θh) cells there
    density = (theta_h + KNEE) / np.sqrt(theta_h)
    theta_d = (np.arange(n_d) + 0.5) / n_d * np.pi / 2
    phi_d = (np.arange(n_p) + 0.5) / n_p * np.pi
    grid = np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")
    weight = np.broadcast_to(density[:, None, None], nodes) / (density.sum() * n_d * n_p)
    cos_i, cos_o = cosines(*grid)
    seen = np.minimum(cos_i, cos_o) > np.cos(MAX_THETA)
    return Angles(*(a[seen] for a in grid)), weight[seen]
