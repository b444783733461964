"""A triangle mesh from OBJ or PLY (trimesh reads), with smooth vertex normals."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from ..errors import InputError

FORMATS = {".ply": "ply", ".obj": "obj"}


@dataclass(frozen=True)
class Mesh:
    """vertices: (v, 3) float64, scan units; faces: (f, 3) int32, counter-clockwise from outside;
    face_attributes: name → (f,) int32, the integer face properties of the file."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    face_attributes: dict[str, NDArray[np.int32]] = field(default_factory=dict)

    @cached_property
    def vertex_normals(self) -> NDArray[np.float64]:
        """(v, 3) unit normals, the mean of the adjoining faces weighted by their angles
        (Thürmer & Wüthrich 1998: independent of how a surface is cut into triangles)."""
        corners = self.vertices[self.faces]
        face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        face_normals /= np.maximum(np.linalg.norm(face_normals, axis=1, keepdims=True), 1e-300)
        # vertices are split where a texture has seams; the surface is smooth across them
        welded = _welded(self.vertices)
        joints = welded[self.faces]
        normals = np.zeros((int(welded.max()) + 1, 3))
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
    """The triangles of an OBJ or PLY file (larger polygons are cut). Raises InputError."""
    kind = FORMATS.get(path.suffix.lower())
    if kind is None:
        expected = " or ".join(sorted(FORMATS))
        raise InputError(f"mesh format {path.suffix!r} is not read, expected {expected}", file=path)
    if not path.is_file():
        raise InputError("is not a file", file=path)
    try:
        if kind == "obj":
            _check_obj(path)
        with open(path, "rb") as file:
            loaded = trimesh.load(
                file, file_type=kind, process=False, maintain_order=True, skip_materials=True
            )
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    except Exception as error:  # trimesh raises whatever the parser met
        raise InputError(f"not a readable {kind.upper()} mesh ({error})", file=path) from error
    parts = list(loaded.geometry.values()) if isinstance(loaded, trimesh.Scene) else [loaded]
    surfaces = [part for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    if not surfaces:
        raise InputError("the mesh has no faces (a point cloud?): export the surface", file=path)
    joined: trimesh.Trimesh
    joined = surfaces[0] if len(surfaces) == 1 else trimesh.util.concatenate(surfaces)  # type: ignore[assignment]
    vertices = np.asarray(joined.vertices, np.float64)
    faces = np.asarray(joined.faces, np.int32)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError("a vertex is not made of three numbers", file=path)
    if kind == "ply":
        _check_ply_counts(path, len(vertices), len(faces))
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError("faces refer to vertices that are not there", file=path)
    if not np.isfinite(vertices).all():
        raise InputError("vertices are not finite numbers (NaN)", file=path)
    keep = _proper(faces)
    if not keep.any():
        raise InputError("the mesh has no faces but degenerate ones", file=path)
    attributes = _integer_properties(joined, len(faces))
    return Mesh(vertices, faces[keep], {name: a[keep] for name, a in attributes.items()})


def _proper(faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(f,) faces with three different corners, the first of each that stands there twice: Blender
    keeps no others, and face numbers must mean the same on both sides."""
    a, b, c = faces.T
    proper = (a != b) & (b != c) & (c != a)
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    once = np.zeros(len(faces), bool)
    once[first] = True
    return proper & once


def _check_ply_counts(path: Path, vertices: int, faces: int) -> None:
    """Refuse a PLY that holds less than its header says: it is truncated."""
    with open(path, "rb") as file:
        header = file.read(1 << 16).partition(b"end_header")[0]
    for kind, there in (("vertex", vertices), ("face", faces)):
        said = re.search(rf"^element {kind} (\d+)".encode(), header, re.MULTILINE)
        if said and there < int(said.group(1)):
            raise InputError(
                f"is truncated: its header says {said.group(1).decode()} elements of kind "
                f"{kind!r}, {there} are there",
                file=path,
            )


def _check_obj(path: Path) -> None:
    """Refuse index 0: OBJ counts from 1, and trimesh would take it for the last vertex."""
    zero = re.compile(rb"^f[ \t](?:[^\r\n]*[ \t])?0+(?:[/ \t]|\r?$)", re.MULTILINE)
    if zero.search(path.read_bytes()):
        raise InputError("a face refers to vertex 0; OBJ files count from 1", file=path)


def _welded(vertices: NDArray[np.float64]) -> NDArray[np.intp]:
    """(v,) a number for every distinct position."""
    rows = np.ascontiguousarray(vertices + 0.0)  # −0 and 0 are one place
    as_bytes = rows.view(np.dtype((np.void, rows.dtype.itemsize * 3))).ravel()
    return np.unique(as_bytes, return_inverse=True)[1].ravel()


def _integer_properties(loaded: trimesh.Trimesh, count: int) -> dict[str, NDArray[np.int32]]:
    """Integer properties of a PLY's faces (only where its polygons were triangles already)."""
    raw = loaded.metadata.get("_ply_raw", {}).get("face", {}).get("data")
    if raw is None:
        return {}
    names = raw.dtype.names if isinstance(raw, np.ndarray) and raw.dtype.names else tuple(raw)
    found = {}
    for name in names:
        values = np.asarray(raw[name]).squeeze()
        if values.shape == (count,) and np.issubdtype(values.dtype, np.integer):
            found[str(name)] = values.astype(np.int32)
    return found
