"""A scanned mesh as the viewer draws it: upright, inside the unit sphere, few triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_FACES = 120_000  # more are merged: 2 MB in the page, and a laptop draws them in 1 ms
MAX_CELLS = 2**20  # along each axis: three numbers of a cell are one integer
MARGIN = 1.02  # of the unit sphere around the object


Array = NDArray[np.floating]
Variation = Callable[[NDArray[np.integer], Array, Array], Array]


@dataclass(frozen=True)
class Part:
    """The faces of one material: its index, and (3 f,) uint32 corners of the faces. factors: (v,
    10) float16 for each point of the object: factors of the diffuse part (3), of the specular part
    (3), of the roughness, and a vector (3) that is added to the normal; None where the material is
    even."""

    material: int
    corners: NDArray[np.uint32]
    factors: NDArray[np.float16] | None = None


@dataclass(frozen=True)
class ViewerObject:
    """positions: (v, 3) float32, z up."""

    positions: NDArray[np.float32]
    parts: tuple[Part, ...]

    @classmethod
    def of(
        cls,
        vertices: NDArray[np.floating],
        faces: NDArray[np.integer],
        material: NDArray[np.integer],
        up: NDArray[np.floating] | None = None,
        seen_from: NDArray[np.floating] | None = None,
        variation: Variation | None = None,
    ) -> ViewerObject:
        """vertices: (v, 3); faces: (f, 3); material: (f,) index of each face's material, negative
        for none. up: (3,) unit vector in their frame, None for z. seen_from: (3,) a point of the
        same frame from which the viewer shows the object first. variation: function (face,
        barycentric weights of its second and third corner) → (m, 10) like Part.factors, the vector
        in the frame of the vertices."""
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
        parts = []
        for own in np.unique(material):
            mine = material == own
            factors = None
            if variation is not None:
                factors = _at_points(variation, faces[mine], kept[mine], len(points), turn)
            parts.append(Part(int(own), faces[mine].astype(np.uint32).ravel(), factors))
        return cls(points.astype(np.float32), tuple(parts))


def _at_points(
    variation: Variation,
    faces: NDArray[np.integer],
    original: NDArray[np.integer],
    count: int,
    turn: NDArray[np.float64],
) -> NDArray[np.float16]:
    """(count, 10) the variation at the points of some faces, from one of the faces of each. turn:
    rotation of the vector."""
    corners = faces.T.ravel()  # all first corners, all second, all third
    used, place = np.unique(corners, return_index=True)
    which, corner = original[place % len(faces)], place // len(faces)
    found = variation(which, (corner == 1).astype(float), (corner == 2).astype(float))
    out = np.zeros((count, 10), np.float16)
    out[used, :7] = found[:, :7]
    out[used, 7:] = found[:, 7:] @ turn.T
    return out


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
    corners = points[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = float(np.linalg.norm(area, axis=1).sum()) / 2
    # a surface has about three faces for each square of the grid that its area fills
    cells = min(extent / max(np.sqrt(3 * total / most), 1e-12), MAX_CELLS)
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
