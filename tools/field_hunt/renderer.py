"""Photos of an exact surface in direct light: rays, smooth normals, the neural encoding of a
measured material. Unlike a path tracer's estimate of a measured material they have no noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles
from patina.core.geometry import RayScene, view_surface
from patina.core.geometry.view import cast_shadow
from patina.core.scan import Camera as ScanCamera
from patina.core.scan import Mesh
from patina.core.scan.camera import Pose

from ..demo_render import Camera
from ..demo_shape import Surface

Array = NDArray[np.floating]
Evaluate = Callable[[Angles], Array]

SUB = 2  # rays per pixel and axis: highlights on thin parts are narrower than a pixel


@dataclass(frozen=True)
class Lamp:
    """direction: (3,) unit, of a distant lamp, or position: (3,) of a near one. irradiance: of a
    distant lamp, or of a near one at distance 1."""

    irradiance: float
    direction: Array | None = None
    position: Array | None = None


@dataclass(frozen=True)
class Seen:
    """The surface in the rays of a photo: index of each ray that hits, (s,) of the fine picture;
    point, normal, view: (s, 3)."""

    index: NDArray[np.int64]
    point: Array
    normal: Array
    view: Array


@dataclass
class Renderer:
    """evaluate: name of a material → its BRDF. material: (points (s, 3)) → (s,) index into
    ``names``. factor: (points) → (s, 3) factor of the reflectance. blocked: (points, direction to
    the lamp) → (s,) fraction of the light that something outside the scan takes."""

    surface: Surface
    evaluate: Mapping[str, Evaluate]
    names: list[str]
    material: Callable[[Array], NDArray[np.intp]] | None = None
    factor: Callable[[Array], Array] | None = None
    blocked: Callable[[Array, Array], Array] | None = None
    rays: RayScene | None = None
    _seen: dict[tuple[bytes, bytes, tuple[int, int]], Seen] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.rays is None:  # a copy with another material or shadow has the same surface
            mesh = Mesh(self.surface.points, self.surface.triangles.astype(np.int32))
            self.rays = RayScene.build(mesh)

    def photo(self, camera: Camera, lamp: Lamp) -> NDArray[np.float64]:
        """(h, w, 3) linear radiance."""
        seen = self._surface(camera)
        towards, irradiance, distance = _incident(seen.point, lamp)
        cosine = np.einsum("ij,ij->i", seen.normal, towards)
        rows = np.flatnonzero(cosine > 0)
        rows = rows[
            ~cast_shadow(
                self.rays, seen.point[rows], seen.normal[rows].astype(np.float32), towards[rows],
                None if distance is None else distance[rows],
            )
        ]  # fmt: skip
        light = irradiance[rows] * cosine[rows]
        if self.blocked is not None:
            light = light * (1 - self.blocked(seen.point[rows], towards[rows]))
        angles = half_angles(seen.normal[rows], towards[rows], seen.view[rows])
        which = np.zeros(len(rows), np.intp)
        if self.material is not None:
            which = self.material(seen.point[rows])
        rho = np.zeros((len(rows), 3))
        for k, name in enumerate(self.names):
            mine = np.flatnonzero(which == k)
            if len(mine):
                rho[mine] = self.evaluate[name](Angles(*(a[mine] for a in angles)))
        radiance = rho * light[:, None]
        if self.factor is not None:
            radiance *= self.factor(seen.point[rows])
        width, height = camera.size
        fine = np.zeros((SUB * height * SUB * width, 3))
        fine[seen.index[rows]] = radiance
        blocks = fine.reshape(height, SUB, width, SUB, 3)
        return np.asarray(blocks.mean(axis=(1, 3)))

    def _surface(self, camera: Camera) -> Seen:
        key = camera.rotation.tobytes(), camera.translation.tobytes(), camera.size
        if key not in self._seen:
            width, height = camera.size
            parameters = (camera.focal, camera.focal, *camera.centre)
            pose = Pose(camera.rotation, camera.translation)
            one = ScanCamera("view", width, height, "PINHOLE", parameters, pose)
            view = view_surface(self.rays, one.resized(SUB * width, SUB * height))
            point = np.asarray(view.point, np.float64)
            normal = np.asarray(view.normal, np.float64)
            self._seen[key] = Seen(
                view.pixel.astype(np.int64), point, normal, np.asarray(view.view, np.float64)
            )
        return self._seen[key]


def _incident(points: Array, lamp: Lamp) -> tuple[Array, Array, Array | None]:
    """((s, 3) directions to the lamp, (s,) irradiance, (s,) distances or None)."""
    if lamp.direction is not None:
        towards = np.broadcast_to(lamp.direction, points.shape)
        return towards, np.full(len(points), lamp.irradiance), None
    assert lamp.position is not None
    away = lamp.position - points
    distance = np.linalg.norm(away, axis=1)
    return away / distance[:, None], lamp.irradiance / distance**2, distance


def half_angles(normal: Array, light: Array, view: Array) -> Angles:
    """Half/difference angles (Rusinkiewicz 1998) of (s, 3) unit vectors, written out with the
    rotation of its definition: Patina's own formula is checked against it."""
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    cos_h = np.clip(np.einsum("ij,ij->i", normal, half), -1, 1)
    cos_d = np.clip(np.einsum("ij,ij->i", light, half), -1, 1)
    # the normal and the light, projected on the plane perpendicular to the half vector
    flat_n = normal - cos_h[:, None] * half
    flat_l = light - cos_d[:, None] * half
    sine = np.einsum("ij,ij->i", half, np.cross(flat_n, flat_l))
    phi = np.arctan2(sine, np.einsum("ij,ij->i", flat_n, flat_l))
    return Angles(np.arccos(cos_h), np.arccos(cos_d), np.mod(phi, np.pi))
