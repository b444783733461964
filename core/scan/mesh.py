"""A triangle mesh with smooth vertex normals, and its reader."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .mesh_formats import Polygons
from .mesh_formats.distinct import distinct_places, distinct_rows
from .mesh_formats.gltf import read_gltf
from .mesh_formats.obj import read_obj
from .mesh_formats.ply import read_ply
from .mesh_formats.stl import read_stl

READERS = {
    ".ply": read_ply,
    ".obj": read_obj,
    ".stl": read_stl,
    ".glb": read_gltf,
    ".gltf": read_gltf,
}
MAX_FILE_BYTES = 4 << 30  # the size of a file with 10^8 triangles
MIN_SIZE = 1e-12  # scan units; products of shorter edges underflow


@dataclass(frozen=True)
class Mesh:
    """vertices: (v, 3) float64, scan units; faces: (f, 3) int32, counter-clockwise from outside;
    face_attributes: name → (f,) int32, the integer face properties of the file; "material" is the
    index into face_materials of a file with named materials (−1: none).

    Optional: vertex_colours: (v, 3) uint8 sRGB; uv: (f, 3, 2) float32 of the faces' corners, u to
    the right, v upwards; face_materials: names; textures: one file (or None) for each material, or
    one for the whole mesh (not opened; they need not exist); notes: sentences about the file for
    the user.
    """

    STORED_APART: ClassVar[bool] = True

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    face_attributes: dict[str, NDArray[np.int32]] = field(default_factory=dict)
    vertex_colours: NDArray[np.uint8] | None = None
    uv: NDArray[np.float32] | None = None
    face_materials: tuple[str, ...] = ()
    textures: tuple[Path | None, ...] = ()
    notes: tuple[str, ...] = ()

    @cached_property
    def face_normals(self) -> NDArray[np.float64]:
        """(f, 3) unit normals of the flat triangles; 0 for triangles without area."""
        corners = self.vertices[self.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        return normals

    @cached_property
    def vertex_normals(self) -> NDArray[np.float64]:
        """(v, 3) unit normals: the mean of the adjacent face normals weighted by the angles of the
        faces at the vertex (Thürmer & Wüthrich 1998: independent of the triangulation)."""
        corners = self.vertices[self.faces]
        face_normals = self.face_normals
        # vertices may be split at texture seams; the surface is smooth across them
        first, welded = distinct_places(self.vertices)
        welded_faces = welded[self.faces]
        normals = np.zeros((len(first), 3))
        for k in range(3):
            a = corners[:, (k + 1) % 3] - corners[:, k]
            b = corners[:, (k + 2) % 3] - corners[:, k]
            angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
            for axis in range(3):
                normals[:, axis] += np.bincount(
                    welded_faces[:, k], angle * face_normals[:, axis], len(normals)
                )
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])
        return normals[welded]

    @cached_property
    def area(self) -> float:
        """Area of all faces, square scan units."""
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box of the vertices that faces use, scan units."""
        used = self.vertices[np.unique(self.faces)]
        return float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)))


def read_mesh(path: Path) -> Mesh:
    """The triangles of an OBJ, PLY, STL, GLB or glTF file, in the file's own frame and unit.

    Polygons are triangulated. Vertices with equal position (and colour) are merged. Duplicate faces
    and faces with repeated vertices are dropped. Raises InputError.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        expected = ", ".join(sorted(READERS))
        raise InputError(
            f"the mesh format {path.suffix!r} is not supported; expected one of {expected}",
            file=path,
        )
    if not path.is_file():
        raise InputError("is not a file", file=path)
    try:
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise InputError(
                f"has {size / 2**30:.1f} GiB; expected at most {MAX_FILE_BYTES >> 30} GiB; "
                "reduce the mesh",
                file=path,
            )
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    if not data:
        raise InputError("is empty", file=path)
    with np.errstate(invalid="ignore", over="ignore"):  # non-finite values are rejected below
        polygons = reader(data, path)
    polygons.check(path)
    return _mesh(polygons, path)


def _mesh(polygons: Polygons, path: Path) -> Mesh:
    """Triangles between distinct vertices."""
    corners, owner = polygons.triangles(path)
    first, number = distinct_places(polygons.vertices, polygons.vertex_colours)
    faces = number.astype(np.int32)[polygons.corners[corners]]
    keep = _valid_faces(faces)
    if not keep.any():
        raise InputError(
            "all faces of the mesh are degenerate; expected triangles with an area", file=path
        )
    notes, uv, colours = polygons.notes, None, polygons.vertex_colours
    if polygons.corner_uv is not None:
        if np.isfinite(polygons.corner_uv).all():
            uv = polygons.corner_uv[corners[keep]]
        else:
            notes += ("Some texture coordinates of the mesh are not finite; all were left out.",)
    mesh = Mesh(
        polygons.vertices[first],
        faces[keep],
        {name: a[owner[keep]] for name, a in polygons.attributes.items()},
        None if colours is None else colours[first],
        uv,
        polygons.materials,
        polygons.textures,
        notes,
    )
    if mesh.size < MIN_SIZE:
        raise InputError(
            f"the mesh has a size of {mesh.size:.2g}; expected at least 1e-12 units", file=path
        )
    return mesh


def _valid_faces(faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(f,) faces with three different corners, and only the first of duplicates. Blender drops the
    others too, so that face indices agree on both sides."""
    a, b, c = faces.T
    valid = (a != b) & (b != c) & (c != a)
    first_occurrence = np.zeros(len(faces), bool)
    first_occurrence[distinct_rows(np.sort(faces, axis=1))[0]] = True
    return valid & first_occurrence
