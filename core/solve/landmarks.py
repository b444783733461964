"""Points of the scan that its own photos show, with their descriptors."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..errors import InputError
from ..geometry import RayScene
from ..geometry.pixel_hits import pixel_hits
from ..scan import Camera
from .features import Features

Array = NDArray[np.float64]
MIN_RAY_COSINE = (
    0.2  # between ray and normal; at lower values a pixel's error covers a large distance
)
MAX_FEATURE_DISTANCE = 1.5  # pixels between a feature found here and one of the COLMAP model


@dataclass(frozen=True)
class Landmarks:
    """points: (n, 3), scan frame and units; descriptors: (n, 128)."""

    points: Array
    descriptors: NDArray[np.uint8]

    @classmethod
    def none(cls) -> Landmarks:
        """Landmarks of a photo without known points."""
        return cls(np.zeros((0, 3)), np.zeros((0, 128), np.uint8))

    def __len__(self) -> int:
        return len(self.points)


class OnMesh:
    """Lifts features to the mesh, for cameras of any format and any lens."""

    def __init__(self, rays: RayScene) -> None:
        self.rays = rays

    def lift(self, camera: Camera, found: Features) -> Landmarks:
        """Points where the rays of a photo's features hit the mesh. camera: of the photo's size."""
        points = np.full((len(found), 3), np.nan)
        if len(found):
            hit, selected, view = pixel_hits(self.rays, camera, found.pixels)
            normal = self.rays.mesh.face_normals[selected.face]
            not_grazing = np.abs(np.einsum("ij,ij->i", normal, view)) > MIN_RAY_COSINE
            points[np.flatnonzero(hit)[not_grazing]] = self.rays.points(selected)[not_grazing]
        known = np.isfinite(points[:, 0])
        return Landmarks(points[known], found.descriptors[known])

    def visible(self, points: Array, centre: Array) -> NDArray[np.bool_]:
        """(n,) whether the mesh does not block the line from ``centre`` (3,) to the points (n,
        3)."""
        towards = centre - points
        distance = np.linalg.norm(towards, axis=1, keepdims=True)
        start = points + 1e-3 * towards
        return ~self.rays.occluded(start, towards / np.maximum(distance, 1e-300))


class OnSparsePoints:
    """Features that a COLMAP model has triangulated, for a scan without a mesh."""

    def __init__(self, model: Path) -> None:
        """Raises InputError where the folder holds no readable model."""
        try:
            found = pycolmap.Reconstruction(str(model))
        except Exception as error:  # pycolmap raises many types of exception
            raise InputError(f"is not a readable COLMAP model ({error})", file=model) from error
        self._seen: dict[str, tuple[Array, Array, tuple[int, int]]] = {}
        positions = {i: point.xyz for i, point in found.points3D.items()}
        for image in found.images.values():
            if image.has_pose:
                known = [p for p in image.points2D if p.has_point3D()]
                lens = found.cameras[image.camera_id]
                self._seen[image.name] = (
                    np.array([p.xy for p in known], np.float64).reshape(-1, 2),
                    np.array([positions[p.point3D_id] for p in known]).reshape(-1, 3),
                    (int(lens.width), int(lens.height)),
                )

    def lift(self, camera: Camera, found: Features) -> Landmarks:
        """The model's points at the features that coincide with the model's own."""
        pixels, points, size = self._seen[camera.label]
        if not len(pixels) or not len(found):
            return Landmarks.none()
        scaled = pixels * (camera.width / size[0], camera.height / size[1])
        distance, nearest = cKDTree(scaled).query(
            found.pixels, distance_upper_bound=MAX_FEATURE_DISTANCE
        )
        known = np.isfinite(distance)
        return Landmarks(points[nearest[known]], found.descriptors[known])

    def visible(self, points: Array, centre: Array) -> NDArray[np.bool_]:
        """(n,) True for all: visibility is unknown without a surface."""
        return np.ones(len(points), bool)
