"""The texels of a texture that the faces of the mesh cover, each with its position on a face.

A texel belongs to the face whose triangle in UV space contains its centre. The intersection of an
edge with a row of centres is computed from its end points in a fixed order. It is therefore equal
for both triangles at a shared edge, and every centre is inside exactly one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scan import Mesh

MIN_SIDE, MAX_SIDE = 16, 8192
BAND = 1 << 20  # texels of the rows that are processed at once
TEXELS_AT_ONCE = 1 << 21  # texels of faces that are processed at once
UV_TOLERANCE = 1e-4  # coordinates farther outside 0 … 1 are outside the texture
MAX_LAYERS = 64.0  # total UV area of the faces, in textures: real UV layouts have far fewer layers


@dataclass(frozen=True)
class Texels:
    """n covered texels of a square texture, in row-major order, each once.

    size: texels a side; row 0 is at the top, v = 1. place: (n,) int32 flat indices. face: (n,)
    int32. second, third: (n,) float32 barycentric weights of the second and third vertex of the
    face. overlapped: number of texels that several faces cover (the first face is kept). outside:
    number of faces with coordinates outside the texture.
    """

    size: int
    place: NDArray[np.int32]
    face: NDArray[np.int32]
    second: NDArray[np.float32]
    third: NDArray[np.float32]
    overlapped: int = 0
    outside: int = 0

    def __len__(self) -> int:
        return len(self.place)

    def blend(self, mesh: Mesh, per_vertex: NDArray, rows: slice | NDArray) -> NDArray[np.float64]:
        """(m, …) values per vertex (v, …), interpolated at the texels ``rows``."""
        face = self.face[rows]
        second, third = (w[rows].astype(np.float64) for w in (self.second, self.third))
        shape = (-1,) + (1,) * (per_vertex.ndim - 1)
        a, b, c = (per_vertex[mesh.faces[face, k]] for k in range(3))
        first = (1.0 - second - third).reshape(shape)
        blended: NDArray[np.float64] = a * first
        blended = blended + b * second.reshape(shape) + c * third.reshape(shape)
        return blended

    def points(self, mesh: Mesh, rows: slice | NDArray) -> NDArray[np.float64]:
        """(m, 3) surface points, scan frame."""
        return self.blend(mesh, mesh.vertices, rows)

    def normals(self, mesh: Mesh, rows: slice | NDArray) -> NDArray[np.float64]:
        """(m, 3) unit smooth normals, scan frame."""
        found = self.blend(mesh, mesh.vertex_normals, rows)
        return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)

    def image(self, values: NDArray, fill: float = 0.0) -> NDArray:
        """(size, size, …) image of values (n, …) at their texels, ``fill`` elsewhere."""
        out = np.full((self.size * self.size, *values.shape[1:]), fill, values.dtype)
        out[self.place] = values
        return out.reshape(self.size, self.size, *values.shape[1:])


def check_size(size: int) -> None:
    """Raise InputError for an unsupported size of a texture, texels a side."""
    if not MIN_SIDE <= size <= MAX_SIDE:
        raise InputError(
            f"found {size}; expected {MIN_SIDE} to {MAX_SIDE} texels a side", key="--size"
        )


def rasterise(mesh: Mesh, size: int) -> Texels:
    """The covered texels of a texture of ``size`` texels a side. Raises InputError for a mesh
    without texture coordinates, with none inside the texture, or with too many layers."""
    check_size(size)
    if mesh.uv is None:
        raise InputError(
            "the mesh has no texture coordinates (UVs); expected UVs for the maps; export the mesh "
            "with UVs, or unwrap it in Blender (UV > Smart UV Project)"
        )
    uv = mesh.uv.astype(np.float64)
    low, high = uv.min(axis=1), uv.max(axis=1)
    out = ((low < -UV_TOLERANCE) | (high > 1 + UV_TOLERANCE)).any(axis=1)
    box = np.prod(np.clip(high, 0, 1) - np.clip(low, 0, 1), axis=1)
    if box.sum() > 2 * MAX_LAYERS:
        raise InputError(
            f"the faces of the mesh cover the texture {box.sum() / 2:.0f} times; expected UVs "
            "without overlap, because a map has one value for each texel; unwrap the mesh again"
        )
    corner = np.stack([uv[..., 0] * size, (1.0 - uv[..., 1]) * size], axis=-1)
    near = np.flatnonzero(((high > 0) & (low < 1)).all(axis=1) & (np.abs(uv).max((1, 2)) < 1e3))
    top, bottom = corner[near, :, 1].min(axis=1), corner[near, :, 1].max(axis=1)
    height = max(1, BAND // size)
    places, faces, overlapped = [], [], 0
    for first in range(0, size, height):
        last = min(first + height, size)
        some = near[(bottom > first) & (top < last)]
        place, face, twice = _band(corner, some, first, last, size)
        places.append(place)
        faces.append(face)
        overlapped += twice
    place, face = np.concatenate(places), np.concatenate(faces)
    if not len(place):
        raise InputError(
            f"the texture coordinates of the mesh cover no texel of a {size} × {size} texture: "
            f"{int(out.sum()):,} of {len(uv):,} faces are outside 0 … 1, or all of them coincide "
            "in one point; expected UVs within 0 … 1; unwrap the mesh again"
        )
    second, third = _weights(corner, place, face, size)
    return Texels(size, place, face, second, third, overlapped, int(out.sum()))


def _band(
    corner: NDArray[np.float64], faces: NDArray[np.intp], first: int, last: int, size: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
    """(flat texels, faces, number of texels with several faces) of the rows first … last − 1."""
    owner = np.full((last - first) * size, -1, np.int32)
    twice = np.zeros(len(owner), bool)
    for part in _parts(corner, faces, first, last, size):
        place, face = _covered(corner, part, first, last, size)
        place -= first * size
        order = np.argsort(place, kind="stable")
        place, face = place[order], face[order]
        new = np.ones(len(place), bool)
        new[1:] = place[1:] != place[:-1]
        twice[place[~new]] = True
        place, face = place[new], face[new]
        free = owner[place] < 0
        twice[place[~free]] = True
        owner[place[free]] = face[free]
    covered = np.flatnonzero(owner >= 0)
    return (covered + first * size).astype(np.int32), owner[covered], int(twice.sum())


def _parts(
    corner: NDArray[np.float64], faces: NDArray[np.intp], first: int, last: int, size: int
) -> list[NDArray[np.intp]]:
    """The faces in groups that each cover a limited number of texels of the band."""
    low, high = corner[faces].min(axis=1), corner[faces].max(axis=1)
    edge = np.array([[0, first], [size, last]], np.float64)
    extent = np.clip(high, *edge) - np.clip(low, *edge) + 1.0
    group = (np.cumsum(extent[:, 0] * extent[:, 1]) // TEXELS_AT_ONCE).astype(np.int64)
    return [part for part in np.split(faces, np.flatnonzero(np.diff(group)) + 1) if len(part)]


def _covered(
    corner: NDArray[np.float64], faces: NDArray[np.intp], first: int, last: int, size: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(flat texels, faces) of all texel centres in the rows first … last − 1 inside the faces."""
    y = corner[faces, :, 1]
    top = np.clip(np.ceil(y.min(axis=1) - 0.5), first, last).astype(np.int64)
    bottom = np.clip(np.ceil(y.max(axis=1) - 0.5), first, last).astype(np.int64)
    which, row = _ranges(top, bottom)
    centre = row + 0.5
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for k in range(3):
        one, other = corner[faces, k], corner[faces, (k + 1) % 3]
        # fixed order of the end points, the same for both faces at an edge
        turned = (one[:, 1] > other[:, 1]) | (
            (one[:, 1] == other[:, 1]) & (one[:, 0] > other[:, 0])
        )
        start = np.where(turned[:, None], other, one)[which]
        end = np.where(turned[:, None], one, other)[which]
        crossed = (start[:, 1] <= centre) & (centre < end[:, 1])
        rise = np.where(crossed, end[:, 1] - start[:, 1], 1.0)
        x = start[:, 0] + (centre - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
        left = np.where(crossed, np.minimum(left, x), left)
        right = np.where(crossed, np.maximum(right, x), right)
    full = right > left
    which, row, left, right = which[full], row[full], left[full], right[full]
    begin = np.clip(np.ceil(left - 0.5), 0, size).astype(np.int64)
    end_ = np.clip(np.ceil(right - 0.5), 0, size).astype(np.int64)
    span, column = _ranges(begin, end_)
    return row[span] * size + column, faces[which[span]].astype(np.int64)


def _ranges(
    begin: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(index of the range, number) for all numbers begin … end − 1 of each range."""
    count = np.maximum(end - begin, 0)
    which = np.repeat(np.arange(len(begin)), count)
    before = np.cumsum(count) - count
    return which, np.arange(len(which)) - before[which] + begin[which]


def _weights(
    corner: NDArray[np.float64], place: NDArray[np.int32], face: NDArray[np.int32], size: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(n,) barycentric weights of the second and third vertex at the texel centres."""
    second, third = (np.empty(len(place), np.float32) for _ in range(2))
    for start in range(0, len(place), TEXELS_AT_ONCE):
        part = slice(start, start + TEXELS_AT_ONCE)
        row, column = np.divmod(place[part], np.int32(size))
        a, b, c = (corner[face[part], k] for k in range(3))
        x, y = column + 0.5 - a[:, 0], row + 0.5 - a[:, 1]
        (bx, by), (cx, cy) = (b - a).T, (c - a).T
        area = bx * cy - by * cx
        area = np.where(np.abs(area) < 1e-300, 1e-300, area)
        u = np.clip((x * cy - y * cx) / area, 0.0, 1.0)
        v = np.clip((bx * y - by * x) / area, 0.0, 1.0)
        over = np.maximum(u + v, 1.0)
        second[part], third[part] = u / over, v / over
    return second, third
