"""A surface that varies, seen in photos of another model than Patina's: a Lambertian colour under
a GGX lobe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patina.core.angles import Angles, half_difference, light_view
from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.fit import ridge
from patina.core.varying.node_model import NodeModel
from patina.core.varying.observations import Observations

SPACING = 0.02
ALBEDO = 0.3 * np.array([1.0, 0.8, 0.6])
GOLD = np.array([1.6, 1.0, 0.5])  # colour of highlights


@dataclass(frozen=True)
class VaryingScene:
    """n nodes: points, scan normals and true normals (n, 3), colour (n, 3) albedo; roughness: of
    the lobe. seen: observations of all of them in some photos."""

    points: np.ndarray
    normals: np.ndarray
    true_normals: np.ndarray
    colour: np.ndarray
    seen: Observations


def ggx(normal: np.ndarray, light: np.ndarray, view: np.ndarray) -> np.ndarray:
    """(n,) a GGX lobe of roughness α = 0.2 without shadowing, 1/sr."""
    half = light + view
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    cosine = np.sum(normal * half, axis=-1)
    return 0.05 * 0.2**2 / (np.pi * (cosine**2 * (0.2**2 - 1) + 1) ** 2)


def fitted_model() -> NodeModel:
    """The even material as the basis represents it, from random directions."""
    rng, basis = np.random.default_rng(0), default_basis()
    theta_h, theta_d = np.arccos(rng.random(4000)), np.radians(60) * rng.random(4000)
    light, view = light_view(theta_h, theta_d, np.pi * rng.random(4000))
    above = (light[:, 2] > 0.2) & (view[:, 2] > 0.2)
    normal = np.tile([0.0, 0.0, 1.0], (above.sum(), 1))
    light, view = light[above], view[above]
    angles = Angles(*(a.astype(np.float32) for a in half_difference(normal, light, view)))
    rho = ALBEDO / np.pi + ggx(normal, light, view)[:, None]
    _, q = basis.rows(angles, 20)
    brdf = PrincipalBRDF(basis, ridge.solve(q, basis.mapped(rho, angles)))
    return NodeModel.of(brdf)


def scene(
    photos: int, seed: int, vary: bool = True, tilt: float = 0.0, gold: bool = False
) -> VaryingScene:
    """A bumpy square of side 2 with albedo 0.3 in stripes of ± 40 %, photographed from above with a
    distant lamp each. tilt: degrees, error of the scan's normals. gold: whether highlights have the
    colour GOLD where x is positive."""
    rng = np.random.default_rng(seed)
    x, y = np.mgrid[-1:1:SPACING, -1:1:SPACING].reshape(2, -1)
    points = np.stack([x, y, 0.05 * np.sin(5 * x) * np.cos(4 * y)], axis=1)
    true = np.stack([-0.25 * np.cos(5 * x) * np.cos(4 * y),
                     0.2 * np.sin(5 * x) * np.sin(4 * y), np.ones_like(x)], axis=1)  # fmt: skip
    true /= np.linalg.norm(true, axis=1, keepdims=True)
    wave = np.stack([np.sin(7 * x + 3 * y), np.cos(6 * y - 2 * x), np.zeros_like(x)], axis=1)
    scan = true - np.radians(tilt) * wave
    scan /= np.linalg.norm(scan, axis=1, keepdims=True)
    stripes = 1 + 0.4 * np.sin(9 * x) * np.cos(8 * y) if vary else np.ones_like(x)
    colour = stripes[:, None] * ALBEDO
    shine = np.where((x > 0)[:, None] & gold, GOLD, 1.0)
    parts = []
    for photo in range(photos):
        light, view = (_direction(rng) for _ in range(2))
        rho = colour / np.pi + shine * ggx(true, light, view)[:, None]
        cosine = np.maximum(true @ light, 0)
        radiance = rho * cosine[:, None] * (1 + 0.01 * rng.normal(size=rho.shape))
        n = len(points)
        parts.append(
            Observations(
                np.arange(n, dtype=np.int32), np.full(n, photo, np.int16), np.zeros(n, np.uint8),
                radiance.astype(np.float32), np.tile(light, (n, 1)).astype(np.float32),
                np.tile(view, (n, 1)).astype(np.float32), np.ones((n, 3), np.float32),
                np.zeros((n, 3), bool),
            )
        )  # fmt: skip
    return VaryingScene(points, scan.astype(np.float32), true, colour, Observations.joined(parts))


def _direction(rng: np.random.Generator) -> np.ndarray:
    """A unit vector within 50 degrees of the z axis."""
    angle, turn = np.radians(50) * np.sqrt(rng.random()), 2 * np.pi * rng.random()
    return np.array([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)])
