"""A random lumpy object with a waist and two horns, so that it has cast shadows and
interreflection."""

from __future__ import annotations

import numpy as np
import trimesh

from ..demo_shape import Surface, vertex_normals

LUMPS = 7  # of the object
BUMPS = 12  # sine waves of a bump field


def lumpy(seed: int, subdivisions: int = 6) -> Surface:
    """Return a mesh of about 80,000 outward triangles around the origin, of radius about 0.5."""
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    p = np.asarray(ball.vertices, np.float64)
    radius = np.full(len(p), 0.36)
    for _ in range(LUMPS):
        at = _direction(rng)
        sharp = rng.uniform(2.0, 12.0)
        radius += rng.uniform(-0.09, 0.11) * np.exp(sharp * (p @ at - 1.0))
    for _ in range(2):
        at = _direction(rng)
        radius += rng.uniform(0.15, 0.22) * np.exp(rng.uniform(35, 60) * (p @ at - 1.0))
    waist = _direction(rng)
    radius *= 1 - rng.uniform(0.1, 0.25) * np.exp(-(((p @ waist) / 0.22) ** 2))
    wave = _direction(rng)
    radius += 0.006 * np.sin(rng.uniform(14, 22) * (p @ wave) + rng.uniform(0, 6))
    points = p * radius[:, None]
    triangles = np.asarray(ball.faces, np.int64)
    return Surface(points, triangles, vertex_normals(points, triangles))


def _direction(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def bumpy(surface: Surface, height: float, wave: float, seed: int) -> Surface:
    """Return the surface with bumps along its normals.

    height: amplitude, scan units; wave: frequency of the bumps, 1 / scan unit.
    """
    rng = np.random.default_rng(seed)
    p = surface.points
    rise = np.zeros(len(p))
    for _ in range(BUMPS):
        turns = 2 * np.pi * rng.uniform(0.5, 1.0) * wave
        rise += np.sin(turns * (p @ _direction(rng)) + rng.uniform(0, 2 * np.pi))
    points = p + height / np.sqrt(BUMPS / 2) * rise[:, None] * surface.normals
    return Surface(points, surface.triangles, vertex_normals(points, surface.triangles))
