"""A BRDF split into a diffuse body, which has the colour of the surface, and the specular rest.

ρ = body + specular, body = min(ρ, D), D (3,) the level of the BRDF away from its highlight. A texel
scales the body: ρ' = s·min(ρ, D) + (ρ − min(ρ, D)).

min(ρ, D) is at most ρ everywhere, so neither part is negative for any s ≥ 0 and any shape of the
measured lobe. Where the BRDF is below D (shadowed grazing directions), all of it is scaled. The
split needs no lobe model, and is one line in a shader. D is the lower quartile over directions
within LIMIT of the normal: a diffuse surface under a coat has one value in nearly all of them, the
tails of the lobe raise some, and few are so grazing that they are below it.

A metal has no diffuse body: away from its highlight there is only the tail of the lobe. If the body
reflects less than MIN_BODY_SHARE of the light, maps of one colour scale the whole BRDF instead, as
the base colour of a Principled BSDF scales a metal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference

LIMIT = 60.0  # degrees, largest angle of light and view to the normal
POLAR, AZIMUTH = 12, 24  # number of directions along each angle
QUANTILE = 0.25  # of ρ over these directions: the level D
MIN_BODY_SHARE = 0.15  # of the reflected light: with less, the whole BRDF is scaled
EVERYTHING = 1e9  # 1/sr: D of a material that is scaled as a whole


@dataclass(frozen=True)
class BodySplit:
    """level: (3,) D in 1/sr. share: the body's share of the light reflected at normal incidence and
    at 45°. whole: True if the whole BRDF is scaled, because it has almost no diffuse body."""

    level: NDArray[np.float64]
    share: float
    whole: bool

    @property
    def body(self) -> NDArray[np.float64]:
        """(3,) the level up to which ρ is scaled: EVERYTHING if the material is scaled as a
        whole."""
        return np.full(3, EVERYTHING) if self.whole else self.level

    @property
    def mostly_specular(self) -> bool:
        """True if the diffuse body reflects less than MIN_BODY_SHARE of the light."""
        return self.share < MIN_BODY_SHARE

    @property
    def divided(self) -> BodySplit:
        """The split of a material whose body and specular part are scaled apart."""
        return replace(self, whole=False)

    def all_light(
        self, body: NDArray[np.floating], specular: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """(n, 3) factor of all reflected light for factors (n, 3) of the body and of the specular
        part."""
        share = np.float32(self.share)
        return np.asarray(share * body + (1 - share) * specular, np.float32)

    def parts(self, rho: NDArray[np.floating]) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """(body, specular), each (n, 3) in 1/sr, of reflectances ρ (n, 3)."""
        body = np.minimum(rho, self.body.astype(rho.dtype))
        return body, rho - body


def split_body(evaluate: Callable[[Angles], NDArray[np.floating]]) -> BodySplit:
    """The split of ``evaluate(angles) -> (n, 3)`` in 1/sr."""
    light, view = directions()
    normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
    angles = half_difference(normal, light, view)
    rho = np.maximum(np.asarray(evaluate(angles), np.float64), 0.0)
    level = np.quantile(rho, QUANTILE, axis=0, method="inverted_cdf")
    share = _share(evaluate, level)
    return BodySplit(level, share, whole=share < MIN_BODY_SHARE)


def directions() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(light, view), unit (n, 3), within LIMIT of the normal (0, 0, 1), each of the same projected
    solid angle."""
    edges = np.linspace(0.0, np.sin(np.radians(LIMIT)) ** 2, POLAR + 1)
    polar = np.arcsin(np.sqrt(0.5 * (edges[1:] + edges[:-1])))  # equal projected solid angles
    azimuth = np.pi * (np.arange(AZIMUTH) + 0.5) / AZIMUTH
    i, o, phi = (a.ravel() for a in np.meshgrid(polar, polar, azimuth, indexing="ij"))
    light = np.stack([np.sin(i) * np.cos(phi), np.sin(i) * np.sin(phi), np.cos(i)], axis=1)
    view = np.stack([np.sin(o), np.zeros_like(o), np.cos(o)], axis=1)
    return light, view


def _share(evaluate: Callable[[Angles], NDArray[np.floating]], level: NDArray[np.float64]) -> float:
    """The light reflected by min(ρ, level) relative to that by ρ, all channels, view at 0° and 45°.

    Integrated over half vectors, densely near the normal, where lobes are: dω_i = 4 (l·h) dω_h.
    """
    own = total = 0.0
    theta = np.radians(90.0) * ((np.arange(160) + 0.5) / 160) ** 2
    wide = np.gradient(theta)
    phi = 2 * np.pi * (np.arange(32) + 0.5) / 32
    h, p = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    solid = np.repeat(np.sin(theta) * wide, len(phi)) * 2 * np.pi / len(phi)
    half = np.stack([np.sin(h) * np.cos(p), np.sin(h) * np.sin(p), np.cos(h)], axis=1)
    for view_angle in (0.0, 0.25 * np.pi):
        view = np.array([np.sin(view_angle), 0.0, np.cos(view_angle)])
        along = half @ view
        light = 2 * along[:, None] * half - view
        up = (light[:, 2] > 0.01) & (along > 0.01)
        normal = np.broadcast_to([0.0, 0.0, 1.0], light[up].shape)
        angles = half_difference(normal, light[up], np.broadcast_to(view, light[up].shape))
        rho = np.maximum(np.asarray(evaluate(angles), np.float64), 0.0)
        reflected = (light[up, 2] * 4 * along[up] * solid[up])[:, None]
        own += float(np.sum(np.minimum(rho, level) * reflected))
        total += float(np.sum(rho * reflected))
    return own / max(total, 1e-12)
