"""What is painted on photos, carried to the mesh's faces by visibility and voting, and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene, SurfaceView, view_surface
from ..scan import Camera

NONE = -1  # not painted
FACES_AT_ONCE = 1 << 18


@dataclass(frozen=True)
class SeenFaces:
    """Where a photo shows which faces. shape: (h, w) of the photo; pixel: (n,) flat indices and
    face: (n,) what is seen there. A face that no pixel's middle meets, as most are where triangles
    are smaller than pixels, is seen at the pixel of its own middle where nothing hides that."""

    shape: tuple[int, int]
    pixel: NDArray[np.int32]
    face: NDArray[np.int32]
    met: int

    @classmethod
    def of(cls, rays: RayScene, camera: Camera, view: SurfaceView | None = None) -> SeenFaces:
        """view: of the whole photo, where it is there already."""
        view = view_surface(rays, camera) if view is None else view
        met = np.zeros(len(rays.mesh.faces), bool)
        met[view.face] = True
        pixel, face = _middles(rays, camera, np.flatnonzero(~met))
        return cls(
            (camera.height, camera.width),
            np.concatenate([view.pixel, pixel]),
            np.concatenate([view.face, face]),
            len(view.pixel),
        )

    def votes(self, painted: NDArray[np.integer], count: int, faces: int) -> NDArray[np.int64]:
        """(faces, count + 1) how many of a face's pixels wear each of ``count`` materials; the last
        column: none. painted: (h, w), 0 … count − 1, NONE where nothing is painted."""
        worn = painted.ravel().take(self.pixel).astype(np.int64)
        worn[worn < 0] = count
        both = self.face.astype(np.int64) * (count + 1) + worn
        return np.bincount(both, minlength=faces * (count + 1)).reshape(faces, count + 1)

    def image(self, labels: NDArray[np.integer]) -> NDArray[np.int32]:
        """(h, w) what the faces that a photo shows wear, labels (faces,); NONE where it shows none:
        the way back."""
        out = np.full(self.shape[0] * self.shape[1], NONE, np.int32)
        out[self.pixel[: self.met]] = labels[self.face[: self.met]]
        return out.reshape(self.shape)


def carried(labels: NDArray[np.integer], votes: NDArray[np.int64]) -> NDArray[np.int32]:
    """(faces,) what each face wears after the votes (faces, count + 1) of all painted photos: the
    material with most pixels, where these are at least as many as those that nobody painted;
    else what it wore before, labels (faces,)."""
    said, silent = votes[:, :-1], votes[:, -1]
    best = np.argmax(said, axis=1)
    most = said[np.arange(len(said)), best]
    # a tie between the painted and the rest is settled for the stroke, which somebody meant
    return np.where((most > 0) & (most >= silent), best, labels).astype(np.int32)


def _middles(
    rays: RayScene, camera: Camera, faces: NDArray[np.intp]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(pixels, faces) of those whose middle the camera sees."""
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
    """((n, 3) unit, (n,) distance, inf of an orthographic camera's parallel rays)."""
    if camera.orthographic:
        return -camera.rays(np.nan_to_num(place)), np.full(len(points), np.inf)
    towards = camera.pose.centre - points
    distance = np.linalg.norm(towards, axis=1)
    return towards / np.maximum(distance, 1e-30)[:, None], distance
