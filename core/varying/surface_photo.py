"""One photo of the surface: which points it shows, lit, and the pixels that show them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles.vectors import tangents
from ..geometry import RayScene
from ..geometry.view import cast_shadow
from ..light import DistantLight, Incidence, Light, MountedLight, NearLight
from ..scan import Camera
from .labels import PixelLabels

Array = NDArray[np.floating]

MIN_COSINE = 0.1  # of light and view: the default of the samples of a fit
RIM_RAYS = 4  # shadow rays to the rim of a light with a size


@dataclass(frozen=True)
class SurfacePhoto:
    """One photo, prepared for points of the surface. radiance: (h, w, 3) linear; labels: the
    material of each pixel."""

    rays: RayScene
    camera: Camera
    light: Light
    radiance: NDArray[np.float32]
    labels: PixelLabels

    def facing(self, points: Array, normals: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """(rows (k,) of the points that face the camera and lie inside the photo, unit directions
        to the camera (k, 3), pixel positions (k, 2))."""
        centre = self.camera.pose.centre
        if self.camera.orthographic:
            view = np.broadcast_to(-self.camera.pose.rotation[2], points.shape)
        else:
            offset = centre - points
            view = offset / np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-12)
        cosine = np.einsum("ij,ij->i", normals, view)
        rows = np.flatnonzero(cosine > MIN_COSINE)
        pixels = self.camera.project(points[rows])
        with np.errstate(invalid="ignore"):
            inside = (pixels >= 0.5).all(axis=1) & (pixels[:, 0] <= self.camera.width - 0.5)
            inside &= pixels[:, 1] <= self.camera.height - 0.5
        rows = rows[inside]
        return rows, view[rows], pixels[inside]

    def hidden(self, points: Array, normals: Array, view: Array) -> NDArray[np.bool_]:
        """(n,) True where the mesh hides a point from the camera."""
        limits = None
        if not self.camera.orthographic:
            limits = np.linalg.norm(self.camera.pose.centre - points, axis=1)
        lift = np.float32(self.rays.lift) * normals.astype(np.float32)
        return self.rays.occluded(points, view, limits, lift)

    def shadowed(self, points: Array, normals: Array, light: Incidence) -> NDArray[np.bool_]:
        """(n,) True where any part of the light's disc is hidden: penumbras count as shadow."""
        blocked = cast_shadow(self.rays, points, normals, light.towards, light.distance)
        radius = angular_radius(self.light, light)
        if radius is None:
            return blocked
        first, second = tangents(light.towards)
        for k in range(RIM_RAYS):
            turn = 2 * np.pi * k / RIM_RAYS
            offset = np.tan(radius)[:, None] * (np.cos(turn) * first + np.sin(turn) * second)
            towards = light.towards + offset
            towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
            blocked |= cast_shadow(self.rays, points, normals, towards, light.distance)
        return blocked


def angular_radius(light: Light, incidence: Incidence) -> Array | None:
    """(n,) angular radius of the light in radians at each point; None for a light without size."""
    if isinstance(light, DistantLight):
        return None if light.angular_radius <= 0 else np.full(
            len(incidence.towards), light.angular_radius
        )  # fmt: skip
    if isinstance(light, NearLight | MountedLight) and light.radius > 0:
        assert incidence.distance is not None
        return np.arctan(light.radius / np.maximum(incidence.distance, 1e-12))
    return None


def bilinear_corners(pixels: Array, camera: Camera) -> tuple[Array, NDArray[np.intp]]:
    """(weights (n, 4), flat pixels (n, 4)) of bilinear interpolation at positions (n, 2); pixel
    centres are at half-integers."""
    at = pixels - 0.5
    low = np.floor(at).astype(np.intp)
    low[:, 0] = np.clip(low[:, 0], 0, max(camera.width - 2, 0))
    low[:, 1] = np.clip(low[:, 1], 0, max(camera.height - 2, 0))
    x, y = np.clip((at - low).T, 0.0, 1.0)
    right = np.minimum(low[:, 0] + 1, camera.width - 1)
    below = np.minimum(low[:, 1] + 1, camera.height - 1)
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    columns = np.stack([low[:, 0], right, low[:, 0], right], axis=1)
    rows = np.stack([low[:, 1], low[:, 1], below, below], axis=1)
    return weights.astype(np.float32), rows * camera.width + columns
