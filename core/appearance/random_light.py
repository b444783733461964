"""Distance of a model from a BRDF in rendered pictures: points of a sphere under many random skies.

A metric over single directions ignores that light is integrated: errors of opposite sign cancel,
and a lobe's width matters less than its energy (Bieron and Peers 2020, "An adaptive BRDF fitting
metric", select fits by the rendered image for this reason). Here the image itself is fitted. Views
are uniform over the disc of a sphere; each is lit by random but fixed skies of a broad gradient and
patches of light of all widths. Radiance is encoded as sRGB, with white at the 95th percentile of
the true radiance, and clipped there as in an 8-bit picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference
from ..errors import FitError
from .cube_root import Evaluate
from .layered_model import Configuration

Array = NDArray[np.floating]

VIEWS, SKIES = 16, 30  # each view is lit by SKIES skies
NODES = (26, 8)  # half vectors: θh spaced logarithmically, φh over 180°
KNEE = np.radians(0.4)  # θh is spaced linearly below, logarithmically above
LIMB = 0.98  # largest squared distance from the centre of the disc
PATCHES = 5  # patches of light of a sky
WIDTHS = np.radians([2.0, 35.0])  # of the patches, log-uniform
SPREAD, SHARE = 1.6, 2.0  # of the patches' flux: log-normal deviation, ratio to the gradient's
WHITE = 95.0  # percentile of the radiance


@dataclass(frozen=True)
class Pictures:
    """The target of a fit. where: n directions, view after view; parts: for each view its slice of
    them and its light (SKIES, n_view), L·cosθ·dω; encoded: (VIEWS·SKIES, 3) the true pictures in
    [0, 1]; white: radiance that is encoded as 1."""

    where: Configuration
    parts: Sequence[tuple[slice, Array]]
    encoded: Array
    white: float

    @classmethod
    def of(cls, evaluate: Evaluate) -> Pictures:
        """evaluate(angles) -> ρ (n, 3) in 1/sr. Raises FitError where the result has another shape
        or is not finite."""
        angles, where, parts = _light()
        rho = np.asarray(evaluate(angles), float)
        if rho.shape != (len(where.cos_i), 3) or not np.isfinite(rho).all():
            raise FitError(f"the BRDF returned {rho.shape} values, or some that are not finite")
        radiance = np.concatenate([light @ np.maximum(rho[part], 0) for part, light in parts])
        white = max(float(np.percentile(radiance, WHITE)), 1e-9)
        return cls(where, parts, encoded(radiance / white)[0], white)

    def residual(self, f: Array) -> Array:
        """(VIEWS·SKIES, 3): encoded pictures of a model's f (n, 3) minus the true ones."""
        return encoded(self._radiance(f) / self.white)[0] - self.encoded

    def residual_and_slopes(self, f: Array, slopes: Array) -> tuple[Array, Array]:
        """The residual and its derivatives (k, VIEWS·SKIES, 3), from df (k, n, 3)."""
        found, slope = encoded(self._radiance(f) / self.white)
        change = np.concatenate([light @ slopes[:, part] for part, light in self.parts], axis=1)
        return found - self.encoded, change * (slope / self.white)

    def psnr(self, f: Array) -> float:
        """PSNR in dB of the model's pictures."""
        return float(-10 * np.log10(max(np.mean(self.residual(f) ** 2), 1e-6)))

    def _radiance(self, f: Array) -> Array:
        """(VIEWS·SKIES, 3) radiance of the pixels for f (n, 3) in 1/sr."""
        return np.concatenate([light @ f[part] for part, light in self.parts])


def encoded(radiance: Array) -> tuple[Array, Array]:
    """sRGB encoding (IEC 61966-2-1) of radiance, clipped at 1, and its derivative."""
    x = np.clip(radiance, 0.0, 1.0)
    power = np.maximum(x, 0.0031308) ** (1 / 2.4)
    toe = x <= 0.0031308
    value = np.where(toe, 12.92 * x, 1.055 * power - 0.055)
    slope = np.where(toe, 12.92, 1.055 / 2.4 * power / np.maximum(x, 0.0031308))
    return value, np.where(radiance < 1.0, slope, 0.0)


@lru_cache(maxsize=1)
def _light() -> tuple[Angles, Configuration, tuple[tuple[slice, Array], ...]]:
    """Directions and light of all views, identical in every run."""
    rng = np.random.default_rng(20)
    n_h, n_p = NODES
    span = np.log1p(np.pi / 2 / KNEE)
    s = (np.arange(n_h) + 0.5) / n_h
    theta, phi = np.meshgrid(
        KNEE * np.expm1(s * span), (np.arange(n_p) + 0.5) / n_p * np.pi, indexing="ij"
    )
    half = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    ).reshape(-1, 3)
    solid = ((theta + KNEE) * span / n_h * np.sin(theta) * np.pi / n_p).ravel()
    lights, views, parts = [], [], []
    done = 0
    for sine2 in (np.arange(VIEWS) + 0.5) / VIEWS * LIMB:
        view = np.array([np.sqrt(sine2), 0.0, np.sqrt(1 - sine2)])
        cos_d = half @ view
        light = 2 * cos_d[:, None] * half - view
        kept = (cos_d > 1e-3) & (light[:, 2] > 1e-3)
        light = light[kept]
        # dω of the light is 4 cosθd dω of the half vector
        weight = 4 * cos_d[kept] * solid[kept] * light[:, 2]
        mirrored = light * [1, -1, 1]
        sky = np.stack([_sky(rng, light, mirrored) for _ in range(SKIES)])
        parts.append((slice(done, done + len(light)), sky * weight))
        done += len(light)
        lights.append(light)
        views.append(np.broadcast_to(view, light.shape))
    light, view = np.concatenate(lights), np.concatenate(views)
    normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
    angles = half_difference(normal, light, view)
    return angles, Configuration.of(light, view), tuple(parts)


def _sky(rng: np.random.Generator, *directions: Array) -> Array:
    """Sum of a random sky's radiance (n,) over several directions (n, 3); its mean over the sphere
    is 1."""
    up = _direction(rng)
    contrast = rng.uniform(0.0, 1.0)
    patches = [
        (_direction(rng), np.exp(rng.uniform(*np.log(WIDTHS))), np.exp(rng.normal(0.0, SPREAD)))
        for _ in range(PATCHES)
    ]
    total = np.zeros(len(directions[0]))
    for d in directions:
        total += 1.0 + contrast * np.tanh(2.0 * d @ up)
        for centre, width, flux in patches:
            sharp = 1.0 / width**2
            # von Mises–Fisher: as much light as a uniform sky of radiance ``flux``
            peak = flux * 2.0 * sharp / -np.expm1(-2.0 * sharp)
            total += peak * np.exp(sharp * (d @ centre - 1.0)) / PATCHES * SHARE
    return total / (1.0 + SHARE * np.mean([flux for *_, flux in patches]))


def _direction(rng: np.random.Generator) -> Array:
    """A random unit vector."""
    d = rng.normal(size=3)
    return np.asarray(d / np.linalg.norm(d))
