"""A reconstruction tool's output in a common form: cameras, sparse points, frames."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .camera import Camera, Pose

Array = NDArray[np.float64]
SMALLEST_SCALE = float(np.finfo(np.float64).tiny)  # below, numbers lose digits


@dataclass(frozen=True)
class Similarity:
    """x' = scale · rotation · x + translation, between two frames of a scan."""

    rotation: Array  # (3, 3), orthonormal, det +1
    translation: Array  # (3,)
    scale: float = 1.0

    @classmethod
    def of_matrix(cls, matrix: Array) -> Similarity:
        """From a 4 × 4 matrix. Raises ValueError where it is not a similarity (for example a
        reflection or a shear)."""
        matrix = np.asarray(matrix, np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise ValueError("not a 4 × 4 matrix of finite numbers")
        largest = float(np.abs(matrix[:3, :3]).max())
        if largest < SMALLEST_SCALE:
            raise ValueError(f"its largest coefficient is {largest:g}")
        rows = matrix[:3, :3] / largest  # products of these neither overflow nor lose all digits
        determinant = float(rows[0] @ np.cross(rows[1], rows[2]))
        if determinant <= 0:
            raise ValueError("its determinant is not positive")
        length = determinant ** (1 / 3)
        rotation, scale = rows / length, largest * length
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
            raise ValueError("its axes are not perpendicular with equal lengths")
        if not np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-9):
            raise ValueError("its last row is not 0 0 0 1")
        u, _, vt = np.linalg.svd(rotation)
        return cls(u @ vt, matrix[:3, 3].copy(), scale)

    def points(self, points: Array) -> Array:
        """(n, 3) transformed points."""
        return self.scale * points @ self.rotation.T + self.translation

    def camera(self, camera: Camera) -> Camera:
        """The camera transformed with the scene: it sees the transformed points at the same
        pixels."""
        rotation = camera.pose.rotation @ self.rotation.T
        centre = self.scale * self.rotation @ camera.pose.centre + self.translation
        moved = replace(camera, pose=Pose(rotation, -rotation @ centre))
        if camera.orthographic:
            scale_x, scale_y, cx, cy = camera.parameters
            moved = replace(moved, parameters=(scale_x / self.scale, scale_y / self.scale, cx, cy))
        return moved


@dataclass(frozen=True)
class Georeference:
    """Location of a scan on Earth. latitude, longitude: degrees north and east, WGS84; altitude:
    metres; east, north, up: (3,) unit vectors in the frame of the reconstruction's cameras."""

    latitude: float
    longitude: float
    altitude: float
    east: Array
    north: Array
    up: Array


@dataclass(frozen=True)
class Reconstruction:
    """cameras: sorted by label, in one frame. points: (n, 3) sparse points, scan units; colours:
    (n, 3) sRGB. frames: other frames that a mesh of this scan may be in: name → transform from the
    cameras' frame. georeference: where known. notes: sentences about what was left out or assumed.
    """

    cameras: tuple[Camera, ...]
    points: Array = field(default_factory=lambda: np.zeros((0, 3)))
    colours: NDArray[np.uint8] = field(default_factory=lambda: np.zeros((0, 3), np.uint8))
    frames: dict[str, Similarity] = field(default_factory=dict)
    georeference: Georeference | None = None
    notes: tuple[str, ...] = ()

    def moved(self, name: str) -> Reconstruction:
        """The reconstruction transformed to one of the other frames."""
        move = self.frames[name]
        geo = self.georeference
        if geo is not None:
            rotated = {k: move.rotation @ getattr(geo, k) for k in ("east", "north", "up")}
            geo = replace(geo, **rotated)
        return replace(
            self,
            cameras=tuple(move.camera(camera) for camera in self.cameras),
            points=move.points(self.points),
            frames={},
            georeference=geo,
        )


MAX_SIDE = 1 << 17  # pixels
MAX_COORDINATE = (
    1e9  # scan units; georeferenced (geocentric) coordinates are 6.4e6 m from the origin
)


def check_camera(camera: Camera, file: object) -> None:
    """Raise InputError, naming the file, where a camera's values are not valid, whatever the
    format."""
    found = None
    rotation = camera.pose.rotation
    if not (0 < camera.width <= MAX_SIDE and 0 < camera.height <= MAX_SIDE):
        found = f"has {camera.width} × {camera.height} pixels"
    elif not np.isfinite(camera.parameters).all():
        found = "has lens parameters that are not finite"
    elif not (np.isfinite(rotation).all() and np.isfinite(camera.pose.translation).all()):
        found = "has a pose that is not finite"
    elif np.abs(camera.pose.translation).max() > MAX_COORDINATE:
        found = f"has a translation of {np.abs(camera.pose.translation).max():.3g} units"
    elif not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
        found = "has an invalid rotation matrix"
    elif np.linalg.det(rotation) < 0:
        found = "has a rotation matrix that mirrors"
    elif not camera.panoramic:
        lens = camera.lens
        if min(lens.focal_length_x, lens.focal_length_y) <= 1e-6:
            found = f"has a focal length of {lens.focal_length_x:g} pixels"
    if found is not None:
        raise InputError(f"the camera of {camera.label!r} {found}", file=str(file))


def reconstruction_of(cameras: list[Camera], file: object, **others: object) -> Reconstruction:
    """A Reconstruction of these cameras, sorted by label. Raises InputError for an invalid camera,
    for duplicate labels and where there is no camera."""
    seen: set[str] = set()
    for camera in cameras:
        if camera.label in seen:
            raise InputError(f"two images are named {camera.label!r}", file=str(file))
        seen.add(camera.label)
        check_camera(camera, file)
    if not cameras:
        raise InputError("holds no camera with a pose", file=str(file))
    ordered = tuple(sorted(cameras, key=lambda camera: camera.label))
    return Reconstruction(cameras=ordered, **others)  # type: ignore[arg-type]
