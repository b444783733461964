"""Materials painted on the mesh, by vertex colours or in the texture: find their faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..scan import Mesh
from .oklab import oklab

# distance in Oklab; colours of a palette are at least 0.2 apart, black and white 1
TOLERANCE = 0.15
DIVISION = 4  # a face is sampled at the centres of 4 × 4 equal triangles
FACES_PER_BATCH = 1 << 16


def faces_by_vertex_colour(
    mesh: Mesh, colours: Sequence[ArrayLike], tolerance: float = TOLERANCE
) -> NDArray[np.int32]:
    """(f,) index of each face's key colour in ``colours`` (8-bit sRGB); -1: none.

    A vertex gets the nearest key colour (in Oklab), or none if its distance exceeds ``tolerance``.
    A face gets the colour of at least two of its vertices; if all three differ, the one with the
    smallest distance. Raises InputError for a mesh without vertex colours and for wrong keys.
    """
    keys = _keys(colours)
    if mesh.vertex_colours is None:
        raise InputError(
            "the mesh has no vertex colours; paint them and export them with the mesh (PLY), or "
            "define the materials by faces or masks"
        )
    number, distance = _nearest(mesh.vertex_colours, keys, tolerance)
    a, b, c = number[mesh.faces].T
    best = mesh.faces[np.arange(len(a)), np.argmin(distance[mesh.faces], axis=1)]
    return np.where((a == b) | (a == c), a, np.where(b == c, b, number[best])).astype(np.int32)


def faces_by_texture(
    mesh: Mesh,
    image: NDArray[np.uint8],
    colours: Sequence[ArrayLike],
    tolerance: float = TOLERANCE,
    faces: NDArray[np.bool_] | None = None,
) -> NDArray[np.int32]:
    """(f,) index of the key colour in ``colours`` (8-bit sRGB) that covers most of each face; -1:
    none.

    image: (h, w, 3) uint8 sRGB, its first row on top (v = 1); texture coordinates outside 0…1
    repeat it. faces: (f,) the faces that have this texture (default: all; the others get -1).
    Each face is sampled at 16 points of equal weight. A point has no key where none is within
    ``tolerance`` (in Oklab). In a tie the first key wins, and any key wins over none.
    Raises InputError for a mesh without texture coordinates, a wrong image and wrong keys.
    """
    keys = _keys(colours)
    if mesh.uv is None:
        raise InputError(
            "the mesh has no texture coordinates; export them with it (OBJ or GLB), or define the "
            "materials by faces or masks"
        )
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or not image.size:
        raise InputError(
            f"the texture has shape {image.shape} and type {image.dtype}; expected 8-bit RGB"
        )
    selected = np.arange(len(mesh.faces)) if faces is None else np.flatnonzero(faces)
    result = np.full(len(mesh.faces), -1, np.int32)
    weights = _sample_points(DIVISION)
    for begin in range(0, len(selected), FACES_PER_BATCH):
        these = selected[begin : begin + FACES_PER_BATCH]
        uv = np.einsum("pk,fkc->fpc", weights, mesh.uv[these].astype(np.float64))
        seen = _pixels(image, uv.reshape(-1, 2))
        number = _nearest(seen, keys, tolerance)[0].reshape(len(these), -1)
        votes = np.stack([(number == k).sum(axis=1) for k in range(len(keys))], axis=1)
        most = np.argmax(votes, axis=1)
        unnamed = (number < 0).sum(axis=1)
        result[these] = np.where(votes[np.arange(len(these)), most] >= unnamed, most, -1)
    return result


def _keys(colours: Sequence[ArrayLike]) -> NDArray[np.uint8]:
    """(k, 3) checked key colours."""
    try:
        keys = np.array([np.asarray(colour, np.float64) for colour in colours], np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(
            "a key colour is wrong; expected three numbers from 0 to 255 for each"
        ) from error
    if keys.ndim != 2 or keys.shape[1] != 3 or not ((keys >= 0) & (keys <= 255)).all():
        raise InputError("a key colour is wrong; expected three numbers from 0 to 255 for each")
    whole = np.rint(keys).astype(np.uint8)
    if len(np.unique(whole, axis=0)) < len(whole):
        raise InputError("two materials have the same key colour; expected different colours")
    return whole


def _nearest(
    srgb: NDArray[np.uint8], keys: NDArray[np.uint8], tolerance: float
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """(n,) index of the nearest key of each colour, -1 beyond the tolerance; (n,) its distance."""
    lab, key_lab = oklab(srgb), oklab(keys)
    nearest = np.zeros(len(srgb), np.int32)
    distance = np.full(len(srgb), np.inf, np.float32)
    for k, key in enumerate(key_lab):
        from_key = np.sum((lab - key) ** 2, axis=1)
        closer = from_key < distance
        nearest[closer] = k
        distance[closer] = from_key[closer]
    distance = np.sqrt(distance)
    nearest[distance > tolerance] = -1
    return nearest, distance


def _sample_points(division: int) -> NDArray[np.float64]:
    """(division², 3) barycentric coordinates of the centres of equal small triangles."""
    places = []
    for i in range(division):
        for j in range(division - i):
            places.append((i + 1 / 3, j + 1 / 3))
            if i + j < division - 1:
                places.append((i + 2 / 3, j + 2 / 3))
    v, w = np.array(places).T / division
    return np.stack([1 - v - w, v, w], axis=1)


def _pixels(image: NDArray[np.uint8], uv: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(n, 3) colours of the pixels that contain the texture coordinates (n, 2)."""
    height, width = image.shape[:2]
    u, v = (uv - np.floor(uv)).T
    column = np.minimum((u * width).astype(np.intp), width - 1)
    row = np.minimum(((1 - v) * height).astype(np.intp), height - 1)
    return np.asarray(image[row, column])
