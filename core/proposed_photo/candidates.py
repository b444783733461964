"""The photos that can be taken next: the scan's cameras, each with lamps all around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene
from ..geometry.view import cast_shadow
from ..light import Light, MountedLight
from ..scan import Camera, Mesh

Array = NDArray[np.float64]

MAX_CAMERAS = 40  # of the scan, as different as possible
LAMPS = 160  # directions on the sphere, 16° apart
POINTS = 1500  # drawn on the surface of each material
MIN_COSINE = 0.17  # of light and view to the normal (80°): beyond, samples say little
MIN_TILT = 0.2  # length of the mean of the cameras' directions from which they tell where up is
FAR = 1e6  # scan units, of a lamp that counts as infinitely far
EDGE = 0.25  # of the picture's size: a lamp so far beside the picture still dazzles the lens
MIN_LENS_ANGLE = np.radians(20.0)  # between a lamp and the axis of an orthographic camera
BELOW = 0.1  # sine by which a lamp may be lower than the lowest camera


@dataclass(frozen=True)
class SurfacePoints:
    """Points of a material's surface. point: (n, 3) scan units; normal: (n, 3) unit."""

    point: Array
    normal: Array

    @classmethod
    def of(cls, mesh: Mesh, faces: NDArray[np.intp], seed: int = 0) -> SurfacePoints:
        """POINTS points on some faces of a mesh, uniform over their area."""
        corners = mesh.vertices[mesh.faces[faces]]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(across, axis=1)
        rng = np.random.default_rng(seed)
        chosen = rng.choice(len(faces), POINTS, p=area / area.sum())
        u, v = rng.random((2, POINTS))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        weight = np.stack([1 - u - v, u, v], axis=1)[..., None]
        normal = (mesh.vertex_normals[mesh.faces[faces[chosen]]] * weight).sum(axis=1)
        length = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        return cls((corners[chosen] * weight).sum(axis=1), normal / length)


def chosen_cameras(cameras: Sequence[Camera]) -> list[Camera]:
    """Up to MAX_CAMERAS cameras that are far from one another."""
    usable = [camera for camera in cameras if not camera.panoramic]
    if len(usable) <= MAX_CAMERAS:
        return usable
    place = np.array([camera.pose.centre for camera in usable])
    picked = [int(np.argmin(np.linalg.norm(place - place.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(place - place[picked[0]], axis=1)
    while len(picked) < MAX_CAMERAS:
        picked.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(place - place[picked[-1]], axis=1))
    return [usable[i] for i in sorted(picked)]


def lamp_directions(cameras: Sequence[Camera], centre: Array) -> Array:
    """(l, 3) unit directions towards a lamp, evenly on the sphere. Where the cameras show which
    side is up (no photo from below), lamps are not lower than they are."""
    i = np.arange(LAMPS) + 0.5
    z, phi = 1 - 2 * i / LAMPS, np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z**2)
    found = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)
    towards = np.array([camera.pose.centre for camera in cameras]) - centre
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    mean = towards.mean(axis=0)
    if np.linalg.norm(mean) < MIN_TILT:
        return found
    up = mean / np.linalg.norm(mean)
    return np.asarray(found[found @ up >= (towards @ up).min() - BELOW])


def in_picture(camera: Camera, lamps: Array) -> NDArray[np.bool_]:
    """(l,) whether a lamp far away in unit directions (l, 3) is in the picture or close to its
    edge: it would dazzle the lens."""
    ahead = lamps @ camera.pose.rotation[2] > 0
    if camera.orthographic:
        return np.asarray(lamps @ camera.pose.rotation[2] > np.cos(MIN_LENS_ANGLE))
    size = np.array([camera.width, camera.height])
    pixels = camera.project(camera.pose.centre + FAR * lamps)
    near = np.all((pixels > -EDGE * size) & (pixels < (1 + EDGE) * size), axis=1)
    return np.asarray(ahead & near)


def seen_from(rays: RayScene, surface: SurfacePoints, camera: Camera) -> NDArray[np.bool_]:
    """(n,) which points a photo of this camera shows, not too obliquely."""
    view = view_of(surface, camera)
    pixels = camera.project(surface.point)
    inside = np.all((pixels > 0) & (pixels < (camera.width, camera.height)), axis=1)
    return _reached(rays, surface, view, inside)


def view_of(surface: SurfacePoints, camera: Camera) -> Array:
    """(n, 3) unit directions from the points to a camera."""
    if camera.orthographic:
        return np.broadcast_to(-camera.pose.rotation[2], surface.point.shape)
    offset = camera.pose.centre - surface.point
    return np.asarray(offset / np.linalg.norm(offset, axis=1, keepdims=True))


def lit_from(rays: RayScene, surface: SurfacePoints, towards: Array) -> NDArray[np.bool_]:
    """(n,) which points a lamp in unit directions (n, 3) lights, not too obliquely."""
    return _reached(rays, surface, towards, np.ones(len(towards), bool))


def mounted_direction(light: MountedLight, camera: Camera, surface: SurfacePoints) -> Array:
    """(n, 3) unit directions from the points to a flash on a camera."""
    return light.incidence(surface.point, camera).towards


def moves_with_camera(lights: Sequence[Light]) -> MountedLight | None:
    """The flash, where all lights of the lit photos are flashes on the camera."""
    flashes = [light for light in lights if isinstance(light, MountedLight)]
    return flashes[0] if flashes and len(flashes) == len(lights) else None


def _reached(
    rays: RayScene, surface: SurfacePoints, towards: Array, possible: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    found = possible & (np.einsum("ij,ij->i", surface.normal, towards) > MIN_COSINE)
    some = np.flatnonzero(found)
    found[some] = ~cast_shadow(
        rays, surface.point[some], surface.normal[some], np.ascontiguousarray(towards[some]), None
    )
    return found
