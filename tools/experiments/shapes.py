"""Scripted true shapes, all about one unit tall, around the vertical axis through the origin.

jar: the object of the demo. pebble: a sphere with bumps of three sizes. knot: a thick, ribbed
trefoil with strong self-occlusion and self-shadowing, like the paper's dragon.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from patina.core.basis.merl_folder import user_cache
from patina.core.files import atomic_path
from patina.core.scan import Mesh

from .. import demo_shape
from ..demo_shape import Field, make_field

Array = NDArray[np.float64]
CELL = 0.006  # of the grid for meshing
CENTRE = np.array([0.0, 0.0, 0.5])


def waves(wavelength: float, seed: int, count: int = 48) -> Callable[[Array], Array]:
    """Return a smooth random field of points (..., 3), of about unit variance: a sum of plane waves
    of similar wavelength with random directions and phases."""
    rng = np.random.default_rng(seed)
    direction = rng.standard_normal((count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    k = 2 * np.pi / wavelength * rng.uniform(0.7, 1.3, count)[:, None] * direction
    phase = rng.uniform(0, 2 * np.pi, count)

    def field(p: Array) -> Array:
        total = np.zeros(p.shape[:-1])
        for wave, start in zip(k, phase, strict=True):
            total += np.cos(p @ wave + start)
        return total * np.sqrt(2.0 / count)

    return field


def pebble() -> Field:
    """Return a sphere of radius 0.36 with bumps."""
    large, middle, small = waves(0.55, 1), waves(0.22, 2), waves(0.09, 3)

    def field(p: Array) -> Array:
        q = p - CENTRE
        r = np.linalg.norm(q, axis=-1)
        on = 0.36 * q / np.maximum(r, 1e-9)[..., None]
        radius = 0.36 + 0.022 * large(on) + 0.008 * middle(on) + 0.0016 * small(on)
        return 0.7 * (r - radius)

    return field


def knot() -> Field:
    """Return a trefoil tube of varying thickness, with ribs and bumps."""
    t = np.linspace(0, 2 * np.pi, 4001)[:-1]
    line = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), 1.15 * np.sin(3 * t), np.cos(t) - 2 * np.cos(2 * t)], -1
    )
    line = 0.118 * line + CENTRE + [0.0, 0.0, -0.03]
    tree = cKDTree(line)
    bumps = waves(0.16, 4)

    def field(p: Array) -> Array:
        shape = p.shape[:-1]
        distance, at = tree.query(p.reshape(-1, 3), workers=2)
        distance, along = distance.reshape(shape), t[at].reshape(shape)
        radius = 0.088 + 0.014 * np.sin(5 * along) + 0.004 * np.sin(30 * along)
        return 0.8 * (distance - radius - 0.005 * bumps(p))

    return field


FIELDS: dict[str, Callable[[], Field]] = {"jar": make_field, "pebble": pebble, "knot": knot}


@lru_cache(maxsize=3)
def true_shape(name: str, cell: float = CELL) -> Mesh:
    """Return the surface of one of FIELDS as a mesh of about 200,000 triangles.

    The mesh is stored in the user's cache (computing it takes 20 to 40 s).
    """
    code = hashlib.sha256(b"".join(Path(f).read_bytes() for f in (__file__, demo_shape.__file__)))
    stored = user_cache() / f"shape_{name}_{cell:g}_{code.hexdigest()[:12]}.npz"
    if stored.is_file():
        with np.load(stored) as data:
            return Mesh(data["points"], data["triangles"])
    surface = demo_shape.mesh_of(FIELDS[name](), cell)
    triangles = surface.triangles.astype(np.int32)
    stored.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(stored, ".part.npz") as partial:
        np.savez(partial, points=surface.points, triangles=triangles)
    return Mesh(surface.points, triangles)
