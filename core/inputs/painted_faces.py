"""Materials that were painted onto the mesh: by the colours of its vertices, or by its texture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..scan import Mesh
from .oklab import oklab

# in Oklab; neighbouring paints of a palette are 0.2 and more apart, black and white 1
TOLERANCE = 0.15
DIVISION = 4  # a face is looked at in the middles of 4 × 4 equal triangles
FACES_AT_ONCE = 1 << 16


def faces_by_vertex_colour(
    mesh: Mesh, colours: Sequence[ArrayLike], tolerance: float = TOLERANCE
) -> NDArray[np.int32]:
    """(f,) which of the key ``colours`` (8-bit sRGB) each face wears; -1: none.

    A vertex has the key colour nearest to its own (in Oklab), none where that is further away than
    ``tolerance``. A face has what two of its vertices have; of three different ones, the one that
    fits its vertex best. Raises InputError for a mesh without vertex colours and for wrong keys.
    """
    keys = _keys(colours)
    if mesh.vertex_colours is None:
        raise InputError(
            "the mesh has no vertex colours; paint them and export them with the mesh (PLY), or "
            "name the materials in another way"
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
    """(f,) which of the key ``colours`` (8-bit sRGB) covers most of each face; -1: none.

    image: (h, w, 3) uint8 sRGB, its first row on top (v = 1); texture coordinates outside 0…1
    repeat it. faces: (f,) the faces that wear this texture (default: all; the others get -1).
    Every face is looked at in 16 places that stand for equal parts of it; a place is none's where
    no key is within ``tolerance`` (in Oklab). Between equal parts the first key wins, and any key
    over none.
    Raises InputError for a mesh without texture coordinates, a wrong image and wrong keys.
    """
    keys = _keys(colours)
    if mesh.uv is None:
        raise InputError(
            "the mesh has no texture coordinates; export them with it (OBJ or GLB), or name the "
            "materials in another way"
        )
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or not image.size:
        raise InputError(
            f"the texture has shape {image.shape} and type {image.dtype}, expected 8-bit RGB"
        )
    chosen = np.arange(len(mesh.faces)) if faces is None else np.flatnonzero(faces)
    result = np.full(len(mesh.faces), -1, np.int32)
    weights = _places(DIVISION)
    for begin in range(0, len(chosen), FACES_AT_ONCE):
        these = chosen[begin : begin + FACES_AT_ONCE]
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
        raise InputError("key colours are not all three numbers from 0 to 255") from error
    if keys.ndim != 2 or keys.shape[1] != 3 or not ((keys >= 0) & (keys <= 255)).all():
        raise InputError("key colours are not all three numbers from 0 to 255")
    whole = np.rint(keys).astype(np.uint8)
    if len(np.unique(whole, axis=0)) < len(whole):
        raise InputError("two materials have the same key colour")
    return whole


def _nearest(
    srgb: NDArray[np.uint8], keys: NDArray[np.uint8], tolerance: float
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """(n,) the nearest key of each colour, -1 beyond the tolerance, and (n,) its distance."""
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


def _places(division: int) -> NDArray[np.float64]:
    """(division², 3) barycentric coordinates of the middles of equal small triangles."""
    places = []
    for i in range(division):
        for j in range(division - i):
            places.append((i + 1 / 3, j + 1 / 3))
            if i + j < division - 1:
                places.append((i + 2 / 3, j + 2 / 3))
    v, w = np.array(places).T / division
    return np.stack([1 - v - w, v, w], axis=1)


def _pixels(image: NDArray[np.uint8], uv: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(n, 3) the pixels in which texture coordinates (n, 2) lie."""
    height, width = image.shape[:2]
    u, v = (uv - np.floor(uv)).T
    column = np.minimum((u * width).astype(np.intp), width - 1)
    row = np.minimum(((1 - v) * height).astype(np.intp), height - 1)
    return np.asarray(image[row, column])
