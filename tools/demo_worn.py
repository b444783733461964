"""The surface of the second demo: the jar as painted tin, worn down to the metal, and dirty.

Every value is a function of the place, so that it is known at any point of the true mesh.
"""

from __future__ import annotations

import numpy as np

from .demo_shape import Array, Surface, smoothstep
from .objects.finish import Finish

PAINT, BAND, DOT = (
    np.array(c) for c in ([0.36, 0.022, 0.020], [0.58, 0.50, 0.33], [0.02, 0.11, 0.16])
)
METAL, DIRT = np.array([0.82, 0.62, 0.36]), np.array([0.075, 0.052, 0.035])
"""Base colours: red enamel with cream bands and blue dots, over brass; dirt."""

BANDS = ((0.585, 0.016, 0.0), (0.43, 0.035, 0.028), (0.215, 0.018, 0.0), (0.735, 0.012, 0.0))
"""Height, half width and amplitude of the waves of the cream bands, scan units."""

WAVES_OF_BAND, DOTS = 11, 11  # around the jar
DOT_HEIGHT, DOT_RADIUS = 0.325, 0.034
FIELD_WAVES = 24  # random waves that a field is the sum of


def _field(points: Array, number: int, wavelength: float) -> Array:
    """(n,) a smooth random field of standard deviation 1."""
    rng = np.random.default_rng((18, number))
    way = rng.normal(size=(3, FIELD_WAVES)) * 2 * np.pi / wavelength / np.sqrt(3)
    phase = rng.uniform(0, 2 * np.pi, FIELD_WAVES)
    return np.asarray(np.cos(points @ way + phase).sum(axis=1) / np.sqrt(FIELD_WAVES / 2))


def dot_distance(points: Array) -> Array:
    """(n,) distance along the surface from the middle of the nearest dot, scan units."""
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    turn = (azimuth * DOTS / (2 * np.pi) + 0.5) % 1 - 0.5
    across = turn * 2 * np.pi / DOTS * np.hypot(points[:, 0], points[:, 1])
    return np.hypot(across, points[:, 2] - DOT_HEIGHT)


def worn_finish(points: Array, convex: Array) -> Finish:
    """The surface at points (n, 3) of the object's frame. convex: (n,) curvature, standard
    deviations, positive on edges, where paint wears off, negative in hollows, which hold dirt."""
    height, azimuth = points[:, 2], np.arctan2(points[:, 1], points[:, 0])
    paint = np.tile(PAINT, (len(points), 1))
    for level, half, wave in BANDS:
        middle = level + wave * np.cos(WAVES_OF_BAND * azimuth)
        inside = smoothstep(half + 0.003, half - 0.003, np.abs(height - middle))[:, None]
        paint += inside * (BAND - paint)
    away = dot_distance(points)
    inside = smoothstep(DOT_RADIUS + 0.003, DOT_RADIUS - 0.003, away)[:, None]
    paint += inside * (DOT - paint)
    paint = paint * np.exp(0.10 * _field(points, 0, 0.09))[:, None]  # faded unevenly
    worn = 0.9 * _field(points, 1, 0.30) + 0.5 * _field(points, 2, 0.06) + 0.9 * convex
    metal = smoothstep(1.15, 1.35, worn)
    dirt = 0.8 * smoothstep(0.7, 1.7, 0.8 * _field(points, 3, 0.2) - 0.9 * convex)
    clean = (1 - metal)[:, None] * paint + metal[:, None] * METAL
    rough = (1 - metal) * (0.30 + 0.05 * _field(points, 4, 0.25)) + metal * 0.34
    return Finish(
        colour=np.clip((1 - dirt)[:, None] * clean + dirt[:, None] * DIRT, 0.0, 1.0),
        metallic=metal * (1 - dirt),
        roughness=np.clip((1 - dirt) * rough + dirt * 0.8, 0.15, 1.0),
        kind=np.argmax(np.stack([(1 - metal) * (1 - dirt), metal * (1 - dirt), dirt]), axis=0),
    )


def convexity(surface: Surface, rounds: int = 12) -> Array:
    """(n,) how far each point lies outside the mean of its neighbourhood, standard deviations,
    within ± 3."""
    points = surface.points.copy()
    pairs = np.concatenate([surface.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    degree = np.maximum(np.bincount(pairs[:, 0], minlength=len(points)), 1)[:, None]
    for _ in range(rounds):
        total = [np.bincount(pairs[:, 0], points[pairs[:, 1], d], len(points)) for d in range(3)]
        points = 0.5 * points + 0.5 * np.stack(total, axis=-1) / degree
    out = np.einsum("ij,ij->i", surface.points - points, surface.normals)
    return np.clip((out - np.median(out)) / out.std(), -3.0, 3.0)
