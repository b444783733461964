"""What the fits of portable models make small: the error in pictures, and some of the cube root's.

Pictures (random_light.py) are what a material is for, yet they hardly see what few of their pixels
show; the cube-root metric (cube_root.py) keeps the model in order there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cube_root import NODES, Evaluate, Target
from .principled import Configuration
from .random_light import Pictures

Array = NDArray[np.floating]

SHARE = 0.05  # what a relative cube-root error counts against an RMS error of encoded pictures


@dataclass(frozen=True)
class Closeness:
    """Both metrics over one set of directions: ``where``, those of the target first."""

    target: Target
    pictures: Pictures
    where: Configuration

    @classmethod
    def of(cls, evaluate: Evaluate, nodes: tuple[int, int, int] = NODES) -> Closeness:
        """evaluate(angles) -> ρ (n, 3) in 1/sr. Raises FitError where it gives something else."""
        target, pictures = Target.of(evaluate, nodes), Pictures.of(evaluate)
        return cls(target, pictures, target.where.followed_by(pictures.where))

    def residual(self, f: Array) -> Array:
        """(m,) of a model that has f (n, 3) in 1/sr at ``where``; its square sum is made small."""
        n = len(self.target.weight)
        a = self.target.residual(f[:n]) * self._target_scale
        b = self.pictures.residual(f[n:]) * self._picture_scale
        return np.concatenate([a.ravel(), b.ravel()])

    def residual_and_slopes(self, f: Array, slopes: Array) -> tuple[Array, Array]:
        """The residual (m,) and its derivatives (m, k), from df (k, n, 3)."""
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
        """What is made small; its root compares with an RMS error of encoded pictures."""
        return float(np.sum(self.residual(f) ** 2))

    def error(self, f: Array) -> float:
        """Relative cube-root error."""
        return self.target.error(f[: len(self.target.weight)])

    def psnr(self, f: Array) -> float:
        """dB of the model's pictures against the true ones."""
        return self.pictures.psnr(f[len(self.target.weight) :])

    @property
    def _target_scale(self) -> float:
        return SHARE / max(float(np.linalg.norm(self.target.root)), 1e-12)

    @property
    def _picture_scale(self) -> float:
        return float(self.pictures.encoded.size) ** -0.5
