"""The law of reflection on a mirror sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scan.camera import Camera
from .sphere_outline import Sphere

Array = NDArray[np.float64]


def mirror(sphere: Sphere, camera: Camera, pixels: Array) -> tuple[Array, Array]:
    """((n, 3) unit directions to the mirrored light, (n, 3) unit normals), scan frame, for pixels
    (n, 2); NaN for pixels that do not see the sphere."""
    starts, rays = sphere.rays(camera, pixels)
    towards = sphere.centre - starts
    along = (towards * rays).sum(axis=1)
    inside = along**2 - (towards * towards).sum(axis=1) + sphere.radius**2
    with np.errstate(invalid="ignore"):
        distance = along - np.sqrt(inside)
    normals = (starts + distance[:, None] * rays - sphere.centre) / sphere.radius
    return rays - 2 * (rays * normals).sum(axis=1, keepdims=True) * normals, normals


def mirrored_at(normal: Array, sphere: Sphere, camera: Camera, near: Array) -> Array:
    """(3,) unit direction to the light that is mirrored at the point with this unit normal. near:
    (2,) a pixel close to the point; it gives the rays' direction of an orthographic camera."""
    point = sphere.centre + sphere.radius * normal
    if sphere.origin is None:
        ray = camera.rays(near[None])[0]
    else:
        ray = (point - sphere.origin) / np.linalg.norm(point - sphere.origin)
    return ray - 2 * (ray @ normal) * normal


def solid_angle(corners: Array) -> Array:
    """(n,) solid angle, in steradians, of small quadrilaterals (n, 4, 3) of unit directions."""
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    return 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)
