"""A triangle mesh, with smooth vertex normals, and the way to one from a file."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

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
LARGEST_FILE = 4 << 30  # bytes; a mesh of 10^8 triangles has as many
SMALLEST_SIZE = 1e-12  # scan units; products of shorter edges run out of numbers


@dataclass(frozen=True)
class Mesh:
    """vertices: (v, 3) float64, scan units; faces: (f, 3) int32, counter-clockwise from outside;
    face_attributes: name → (f,) int32, the integer face properties of the file; "material" is the
    place in face_materials of a file that names materials (-1: none).

    What a file may lack: vertex_colours (v, 3) uint8 sRGB; uv (f, 3, 2) float32 of the faces'
    corners, u to the right, v upwards; face_materials: names; textures: one file (or None) for each
    material, or for the whole mesh where there is one (not opened, they need not exist); notes:
    sentences about the file that a user should read."""

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
        """(f, 3) unit normals of the flat triangles, 0 of those without area."""
        corners = self.vertices[self.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        return normals

    @cached_property
    def vertex_normals(self) -> NDArray[np.float64]:
        """(v, 3) unit normals, the mean of the adjoining faces weighted by their angles
        (Thürmer & Wüthrich 1998: independent of how a surface is cut into triangles)."""
        corners = self.vertices[self.faces]
        face_normals = self.face_normals
        # vertices may be split where a texture has seams; the surface is smooth across them
        first, welded = distinct_places(self.vertices)
        joints = welded[self.faces]
        normals = np.zeros((len(first), 3))
        for k in range(3):
            a = corners[:, (k + 1) % 3] - corners[:, k]
            b = corners[:, (k + 2) % 3] - corners[:, k]
            angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
            for axis in range(3):
                normals[:, axis] += np.bincount(
                    joints[:, k], angle * face_normals[:, axis], len(normals)
                )
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])
        return normals[welded]

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box of what the faces use, scan units."""
        used = self.vertices[np.unique(self.faces)]
        return float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)))


def read_mesh(path: Path) -> Mesh:
    """The triangles of an OBJ, PLY, STL, GLB or glTF file, in the file's own frame and unit.

    Larger polygons are cut; vertices at one place (and of one colour) become one; faces without
    area in their corner numbers and doubled ones are dropped. Raises InputError.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        expected = ", ".join(sorted(READERS))
        raise InputError(
            f"mesh format {path.suffix!r} is not read, expected one of {expected}", file=path
        )
    if not path.is_file():
        raise InputError("is not a file", file=path)
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise InputError(
                f"has {size / 2**30:.1f} GiB, expected at most {LARGEST_FILE >> 30}: "
                "reduce the mesh",
                file=path,
            )
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    if not data:
        raise InputError("is empty", file=path)
    with np.errstate(invalid="ignore", over="ignore"):  # what is no number is refused below
        polygons = reader(data, path)
    polygons.check(path)
    return _mesh(polygons, path)


def _mesh(polygons: Polygons, path: Path) -> Mesh:
    """Triangles between distinct vertices."""
    corners, owner = polygons.triangles(path)
    first, number = distinct_places(polygons.vertices, polygons.vertex_colours)
    faces = number.astype(np.int32)[polygons.corners[corners]]
    keep = _proper(faces)
    if not keep.any():
        raise InputError("the mesh has no faces but degenerate ones", file=path)
    notes, uv, colours = polygons.notes, None, polygons.vertex_colours
    if polygons.corner_uv is not None:
        if np.isfinite(polygons.corner_uv).all():
            uv = polygons.corner_uv[corners[keep]]
        else:
            notes += ("its texture coordinates are not all numbers: left out",)
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
    if mesh.size < SMALLEST_SIZE:
        raise InputError(f"the mesh has a size of {mesh.size:.2g}, which is none", file=path)
    return mesh


def _proper(faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(f,) faces with three different corners, the first of each that stands there twice: Blender
    keeps no others, and face numbers must mean the same on both sides."""
    a, b, c = faces.T
    proper = (a != b) & (b != c) & (c != a)
    once = np.zeros(len(faces), bool)
    once[distinct_rows(np.sort(faces, axis=1))[0]] = True
    return proper & once
