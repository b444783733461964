"""Points of the scan that its own photos show, with what they look like there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..errors import InputError
from ..geometry import RayScene
from ..scan import Camera
from .features import Features

Array = NDArray[np.float64]
FLATTEST = 0.2  # cosine between ray and surface: beyond it a pixel's error is many on the surface
SAME_FEATURE = 1.5  # pixels between a feature of ours and one the model was made of


@dataclass(frozen=True)
class Landmarks:
    """points: (n, 3), the scan's frame; descriptors: (n, 128)."""

    points: Array
    descriptors: NDArray[np.uint8]

    @classmethod
    def none(cls) -> Landmarks:
        """Of a photo that shows nothing known."""
        return cls(np.zeros((0, 3)), np.zeros((0, 128), np.uint8))

    def __len__(self) -> int:
        return len(self.points)


class OnMesh:
    """Features lifted to the surface: any format's cameras, any lens."""

    def __init__(self, rays: RayScene) -> None:
        self.rays = rays

    def lift(self, camera: Camera, found: Features) -> Landmarks:
        """Where the rays of a photo's features meet the mesh. camera: with the photo's size."""
        points = np.full((len(found), 3), np.nan)
        if len(found):
            directions = camera.rays(found.pixels)
            sound = np.isfinite(directions).all(axis=1)
            directions[~sound] = (0.0, 0.0, 1.0)
            hits = self.rays.first_hits(camera.ray_starts(found.pixels), directions)
            there = sound & (hits.face >= 0)
            met = hits.select(there)
            normal = self.rays.mesh.face_normals[met.face]
            steep = np.abs(np.einsum("ij,ij->i", normal, directions[there])) > FLATTEST
            points[np.flatnonzero(there)[steep]] = self.rays.points(met)[steep]
        known = np.isfinite(points[:, 0])
        return Landmarks(points[known], found.descriptors[known])

    def visible(self, points: Array, centre: Array) -> NDArray[np.bool_]:
        """(n,) whether nothing lies between ``centre`` and the points."""
        towards = centre - points
        distance = np.linalg.norm(towards, axis=1, keepdims=True)
        start = points + 1e-3 * towards
        return ~self.rays.occluded(start, towards / np.maximum(distance, 1e-300))


class OnSparsePoints:
    """Features that a COLMAP model has triangulated; for a scan that has no mesh."""

    def __init__(self, model: Path) -> None:
        """Raises InputError where the folder holds no readable model."""
        try:
            found = pycolmap.Reconstruction(str(model))
        except Exception as error:  # pycolmap raises whatever its parser met
            raise InputError(f"not a readable COLMAP model ({error})", file=model) from error
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
        """The model's points where its own features lie under ours."""
        pixels, points, size = self._seen[camera.label]
        if not len(pixels) or not len(found):
            return Landmarks.none()
        scaled = pixels * (camera.width / size[0], camera.height / size[1])
        distance, nearest = cKDTree(scaled).query(found.pixels, distance_upper_bound=SAME_FEATURE)
        known = np.isfinite(distance)
        return Landmarks(points[nearest[known]], found.descriptors[known])

    def visible(self, points: Array, centre: Array) -> NDArray[np.bool_]:
        """All: without a surface nobody knows better."""
        return np.ones(len(points), bool)
