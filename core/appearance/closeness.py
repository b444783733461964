"""Objective of the fits of portable models: the error of rendered pictures, plus a small share of
the cube-root error.

Pictures (random_light.py) are what a material is used for, but are insensitive to directions that
few of their pixels show. There the cube-root metric (cube_root.py) constrains the model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cube_root import NODES, Evaluate, Target
from .layered_model import Configuration
from .random_light import Pictures

Array = NDArray[np.floating]

CUBE_ROOT_WEIGHT = (
    0.05  # of the relative cube-root error; the RMS error of encoded pictures has weight 1
)


@dataclass(frozen=True)
class FitObjective:
    """Both metrics over one set of directions ``where``, those of the target first."""

    target: Target
    pictures: Pictures
    where: Configuration

    @classmethod
    def of(cls, evaluate: Evaluate, nodes: tuple[int, int, int] = NODES) -> FitObjective:
        """evaluate(angles) -> ρ (n, 3) in 1/sr. Raises FitError where the result has another shape
        or is not finite."""
        target, pictures = Target.of(evaluate, nodes), Pictures.of(evaluate)
        return cls(target, pictures, target.where.followed_by(pictures.where))

    def residual(self, f: Array) -> Array:
        """(m,) residual of a model with reflectance f (n, 3) in 1/sr at ``where``; its sum of
        squares is the objective."""
        n = len(self.target.weight)
        a = self.target.residual(f[:n]) * self._target_scale
        b = self.pictures.residual(f[n:]) * self._picture_scale
        return np.concatenate([a.ravel(), b.ravel()])

    def residual_and_slopes(self, f: Array, slopes: Array) -> tuple[Array, Array]:
        """The residual (m,) and its Jacobian (m, k), from f (n, 3) and df (k, n, 3)."""
        n, k = len(self.target.weight), len(slopes)
        a, by_a = self.target.residual_and_slopes(f[:n], slopes[:, :n])
        b, by_b = self.pictures.residual_and_slopes(f[n:], slopes[:, n:])
        residual = np.concatenate([a.ravel() * self._target_scale, b.ravel() * self._picture_scale])
        parts = [
            by_a.reshape(k, -1) * self._target_scale,
            by_b.reshape(k, -1) * self._picture_scale,
        ]
        return residual, np.concatenate(parts, axis=1).T

    def cost(self, f: Array) -> float:
        """Sum of the squared residuals, which the fit minimises. Its square root is comparable with
        an RMS error of the pictures after encoding for display."""
        return float(np.sum(self.residual(f) ** 2))

    def error(self, f: Array) -> float:
        """Relative cube-root error of the model."""
        return self.target.error(f[: len(self.target.weight)])

    def psnr(self, f: Array) -> float:
        """PSNR in dB of the model's pictures."""
        return self.pictures.psnr(f[len(self.target.weight) :])

    @property
    def _target_scale(self) -> float:
        """Weight of the cube-root residuals."""
        return CUBE_ROOT_WEIGHT / max(float(np.linalg.norm(self.target.root)), 1e-12)

    @property
    def _picture_scale(self) -> float:
        """Weight of the picture residuals: their sum of squares becomes a mean."""
        return float(self.pictures.encoded.size) ** -0.5
