"""A scanned mesh as the viewer draws it: upright, inside the unit sphere, few triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_FACES = 120_000  # more are merged: a page has at most 25 MB, and a laptop draws this in 1 ms
MARGIN = 1.02  # of the unit sphere around the object


@dataclass(frozen=True)
class ViewerObject:
    """positions: (v, 3) float32, z up. parts: (index of a material, (3 f,) uint32 corners of its
    faces)."""

    positions: NDArray[np.float32]
    parts: tuple[tuple[int, NDArray[np.uint32]], ...]

    @classmethod
    def of(
        cls,
        vertices: NDArray[np.floating],
        faces: NDArray[np.integer],
        material: NDArray[np.integer],
        up: NDArray[np.floating] | None = None,
        seen_from: NDArray[np.floating] | None = None,
    ) -> ViewerObject:
        """vertices: (v, 3); faces: (f, 3); material: (f,) index of each face's material, negative
        for none. up: (3,) unit vector in their frame, None for z. seen_from: (3,) a point of the
        same frame from which the viewer shows the object first."""
        used, corners = np.unique(faces, return_inverse=True)
        points, faces = np.asarray(vertices, float)[used], corners.reshape(-1, 3)
        turn = np.eye(3) if up is None else _upright(np.asarray(up, float))
        if seen_from is not None:
            turn = _facing(turn @ (np.asarray(seen_from, float) - points.mean(axis=0))) @ turn
        points = points @ turn.T
        points, faces, kept = simplified(points, faces)
        material = np.maximum(np.asarray(material)[kept], 0)
        points = points - (points.min(axis=0) + points.max(axis=0)) / 2
        points /= MARGIN * np.linalg.norm(points, axis=1).max()
        parts = tuple(
            (int(own), faces[material == own].astype(np.uint32).ravel())
            for own in np.unique(material)
        )
        return cls(points.astype(np.float32), parts)


def simplified(
    points: NDArray[np.float64], faces: NDArray[np.integer], most: int = MAX_FACES
) -> tuple[NDArray[np.float64], NDArray[np.integer], NDArray[np.intp]]:
    """(points, faces, which of the faces these were) with at most ``most`` faces: points in one
    cell of a cubic grid become their mean (Rossignac and Borrel 1993)."""
    kept = np.arange(len(faces))
    if len(faces) <= most:
        return points, faces, kept
    low = points.min(axis=0)
    extent = float((points.max(axis=0) - low).max())
    cells = np.sqrt(most)  # a closed surface crosses about two faces in each of its cells
    while True:
        place = np.floor((points - low) / extent * cells).astype(np.int64)
        key = (place[:, 0] << 42) + (place[:, 1] << 21) + place[:, 2]
        _, of, count = np.unique(key, return_inverse=True, return_counts=True)
        merged = of[faces]
        a, b, c = merged.T
        kept = np.flatnonzero((a != b) & (b != c) & (c != a))
        if len(kept) <= most:
            break
        cells *= 0.95 * np.sqrt(most / len(kept))
    mean = np.stack([np.bincount(of, points[:, axis]) for axis in range(3)], axis=1)
    return mean / count[:, None], merged[kept], kept


def _upright(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) the smallest rotation that turns ``up`` to z."""
    up = up / np.linalg.norm(up)
    axis, cosine = np.cross(up, [0.0, 0.0, 1.0]), up[2]
    if cosine < -0.999999:
        return np.diag([1.0, -1.0, -1.0])
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + cosine))


def _facing(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) the rotation about z that turns a direction towards −y, where the viewer's camera
    is."""
    length = float(np.hypot(direction[0], direction[1]))
    if length < 1e-9:
        return np.eye(3)
    x, y = direction[:2] / length
    return np.array([[-y, x, 0.0], [-x, -y, 0.0], [0.0, 0.0, 1.0]])
