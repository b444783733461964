"""Transfer of painted labels from photos to the faces of the mesh by voting, and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene, SurfaceView, view_surface
from ..scan import Camera

NONE = -1  # not painted
FACES_AT_ONCE = 1 << 18  # to limit memory


@dataclass(frozen=True)
class VisibleFaces:
    """The visible faces of a photo. shape: (h, w) of the photo; pixel: (n,) flat indices; face:
    (n,) the visible face there. The first ``centre_count`` entries are faces at the centres of
    pixels. The others are faces without a pixel centre (triangles smaller than a pixel), at the
    pixel that contains their centroid, if that is visible."""

    shape: tuple[int, int]
    pixel: NDArray[np.int32]
    face: NDArray[np.int32]
    centre_count: int

    @classmethod
    def of(cls, rays: RayScene, camera: Camera, view: SurfaceView | None = None) -> VisibleFaces:
        """The visible faces for a camera; view: the surface view of the whole photo, if already
        computed."""
        view = view_surface(rays, camera) if view is None else view
        has_centre = np.zeros(len(rays.mesh.faces), bool)
        has_centre[view.face] = True
        pixel, face = _at_centroids(rays, camera, np.flatnonzero(~has_centre))
        return cls(
            (camera.height, camera.width),
            np.concatenate([view.pixel, pixel]),
            np.concatenate([view.face, face]),
            len(view.pixel),
        )

    def votes(self, painted: NDArray[np.integer], count: int, faces: int) -> NDArray[np.int64]:
        """(faces, count + 1) number of pixels of each face with each of ``count`` materials; the
        last column counts unpainted pixels. painted: (h, w), 0 … count − 1 or NONE."""
        label = painted.ravel().take(self.pixel).astype(np.int64)
        label[label < 0] = count
        both = self.face.astype(np.int64) * (count + 1) + label
        return np.bincount(both, minlength=faces * (count + 1)).reshape(faces, count + 1)

    def image(self, labels: NDArray[np.integer]) -> NDArray[np.int32]:
        """(h, w) the labels (faces,) of the faces that the photo shows; NONE without a face."""
        out = np.full(self.shape[0] * self.shape[1], NONE, np.int32)
        out[self.pixel[: self.centre_count]] = labels[self.face[: self.centre_count]]
        return out.reshape(self.shape)


def updated_labels(labels: NDArray[np.integer], votes: NDArray[np.int64]) -> NDArray[np.int32]:
    """(faces,) new labels after the votes (faces, count + 1) of all painted photos: the material
    with most pixels, if these are at least as many as the unpainted ones; otherwise the old label
    of labels (faces,)."""
    painted, unpainted = votes[:, :-1], votes[:, -1]
    best = np.argmax(painted, axis=1)
    most = painted[np.arange(len(painted)), best]
    # a tie is decided for the painted material, since the stroke was intended
    return np.where((most > 0) & (most >= unpainted), best, labels).astype(np.int32)


def _at_centroids(
    rays: RayScene, camera: Camera, faces: NDArray[np.intp]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(flat pixels, faces) of those of ``faces`` whose centroid the camera sees."""
    pixels, seen = [np.zeros(0, np.int32)], [np.zeros(0, np.int32)]
    mesh = rays.mesh
    for begin in range(0, len(faces), FACES_AT_ONCE):
        these = faces[begin : begin + FACES_AT_ONCE]
        corner = mesh.vertices[mesh.faces[these]]
        middle = corner.mean(axis=1)
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = normal / np.maximum(length, 1e-30)
        place = camera.project(middle)
        with np.errstate(invalid="ignore"):
            inside = (place >= 0).all(axis=1) & (place < (camera.width, camera.height)).all(axis=1)
        towards, distance = _to_camera(camera, middle, place)
        facing = np.einsum("fi,fi->f", normal, towards)
        some = np.flatnonzero(inside & (facing > 0))
        lift = np.float32(rays.lift) * normal[some].astype(np.float32)
        limit = (distance[some] * (1 - 1e-4)).astype(np.float32)
        hidden = rays.occluded(middle[some], towards[some].astype(np.float32), limit, lift)
        some = some[~hidden]
        column, row = np.floor(place[some]).astype(np.int32).T
        pixels.append(row * np.int32(camera.width) + column)
        seen.append(these[some].astype(np.int32))
    return np.concatenate(pixels), np.concatenate(seen)


def _to_camera(
    camera: Camera, points: NDArray[np.float64], place: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(unit vectors to the camera (n, 3), distances (n,), infinite for an orthographic camera)."""
    if camera.orthographic:
        return -camera.rays(np.nan_to_num(place)), np.full(len(points), np.inf)
    towards = camera.pose.centre - points
    distance = np.linalg.norm(towards, axis=1)
    return towards / np.maximum(distance, 1e-30)[:, None], distance
