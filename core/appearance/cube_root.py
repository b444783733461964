"""How far a reflectance model is from a BRDF, by the metric that predicts what the eye sees.

The metric is the cosine-weighted cube root of Fores, Ferwerda, Gu 2012 ("Toward a perceptually
based metric for BRDF modeling"), the one of several that agreed with observers; a plain L2 fits
the peak and nothing else (Bieron and Peers 2020). Directions count as they do on the MERL grid,
where those studies were made: uniform in sqrt(θh), θd and φd.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines, light_view
from ..errors import FitError
from .principled import Configuration

Array = NDArray[np.floating]
Evaluate = Callable[[Angles], Array]

HORIZON = np.radians(82.0)  # light and view farther from the normal than this do not count
# nodes of the quadrature over (θh, θd, φd), θh on a logarithm: a lobe of 1° sees 12 of them
NODES = (44, 12, 8)
COARSE = (44, 6, 4)  # as fine along θh, where lobes are sharp; enough to tell the starts apart
DARK = 1e-9  # 1/sr: below it the cube root's slope is not followed
KNEE = np.radians(0.4)


@dataclass(frozen=True)
class Target:
    """What to fit: directions, √weight (n, 1) and ∛(ρ cosθi) (n, 3) times √weight."""

    where: Configuration
    weight: Array
    root: Array

    @classmethod
    def of(cls, evaluate: Evaluate, nodes: tuple[int, int, int] = NODES) -> Target:
        """evaluate(angles) -> ρ (n, 3) in 1/sr. Raises FitError where it gives something else."""
        angles, weight = quadrature(nodes)
        light, view = light_view(*angles)
        rho = np.asarray(evaluate(angles), float)
        if rho.shape != (weight.size, 3) or not np.isfinite(rho).all():
            raise FitError(
                f"the BRDF gave {rho.shape} numbers for {weight.size} directions, or some that "
                "are not finite"
            )
        where = Configuration.of(light, view)
        scale = np.sqrt(weight)[:, None]
        return cls(where, scale, scale * np.cbrt(np.maximum(rho, 0) * where.cos_i[:, None]))

    def residual(self, f: Array) -> Array:
        """(n, 3) of a model that has f (n, 3) in 1/sr at ``where``."""
        return self.weight * np.cbrt(f * self.where.cos_i[:, None]) - self.root

    def residual_and_slopes(self, f: Array, slopes: Array) -> tuple[Array, Array]:
        """The residual and its derivatives (k, n, 3), from df (k, n, 3)."""
        cosine = np.cbrt(self.where.cos_i)[:, None]
        by_f = self.weight * cosine / (3 * np.maximum(f, DARK) ** (2 / 3))
        return self.residual(f), slopes * by_f

    def error(self, f: Array) -> float:
        """‖∛(f cosθi) − ∛(ρ cosθi)‖ / ‖∛(ρ cosθi)‖."""
        length = max(float(np.linalg.norm(self.root)), 1e-12)
        return float(np.linalg.norm(self.residual(f)) / length)

    def lambertian(self) -> Array:
        """Albedo (3,) of the best diffuse surface: linear in its own cube root."""
        shape = self.weight * np.cbrt(self.where.cos_i / np.pi)[:, None]
        return (np.sum(shape * self.root, axis=0) / np.sum(shape**2)) ** 3


def quadrature(nodes: tuple[int, int, int] = NODES) -> tuple[Angles, Array]:
    """Directions (n,) and weights (n,), Σ = 1 before those beyond the horizon are dropped."""
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
    seen = np.minimum(cos_i, cos_o) > np.cos(HORIZON)
    return Angles(*(a[seen] for a in grid)), weight[seen]
