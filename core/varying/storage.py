"""The file varying.npz of a result: how its materials vary over the surface.

A NumPy archive with the arrays of VaryingSurface in half precision (parameters within ±3 keep an
error below 0.1 %), the material of each face, the number of divisions of a face, and a checksum of
the mesh.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import UNREADABLE_NPZ, InputError
from ..npz_file import open_npz, unpacked_bytes
from ..scan import Mesh
from .node_model import COUNT, LIMITS
from .surface_grid import MAX_DIVISIONS, SurfaceGrid
from .varying_surface import VARIATIONS, MaterialVariation, VaryingSurface

NAME = "varying.npz"
FORMAT = 4
MAX_NODES = 1 << 26
MAX_OTHER_BYTES = 1 << 20  # of the archive's headers and of the list of materials


def write(path: Path, surface: VaryingSurface) -> None:
    """Write the file. The caller's folder is staged, so that it is complete or absent."""
    content = {
        "format": np.int32(FORMAT),
        "divisions": np.int32(surface.grid.n),
        "mesh": np.array(mesh_checksum(surface.grid.mesh)),
        "materials": np.array(json.dumps([vars(m) for m in surface.materials])),
        "parameters": surface.parameters.astype(np.float16),
        "deviation": surface.deviation.astype(np.float16),
        "photos": surface.photos,
        "face_material": surface.face_material,
    }
    with path.open("wb") as file:
        np.savez_compressed(file, **content)  # type: ignore[arg-type]


def read(path: Path, mesh: Mesh, materials: int) -> VaryingSurface:
    """Read the file for the mesh of its fit, with so many materials. Raises InputError where it is
    not such a file, or of another mesh."""
    try:
        most = MAX_NODES * (4 * COUNT + 2) + len(mesh.faces) + MAX_OTHER_BYTES
        with open_npz(path, most) as stored:
            return _surface(stored, path, mesh, materials, unpacked_bytes(stored.zip))
    except (*UNREADABLE_NPZ, TypeError) as error:
        raise InputError(
            f"is not a file that `fit --varying` wrote ({error}); fit again", file=path
        ) from error


def mesh_checksum(mesh: Mesh) -> str:
    """A short checksum of vertices and faces."""
    digest = hashlib.sha256(np.asarray(mesh.vertices, np.float64).tobytes())
    digest.update(np.asarray(mesh.faces, np.int32).tobytes())
    return digest.hexdigest()[:16]


def _surface(stored: Any, path: Path, mesh: Mesh, materials: int, declared: int) -> VaryingSurface:
    if int(stored["format"]) != FORMAT:
        raise InputError("was written by another version of Patina; fit again", file=path)
    if str(stored["mesh"]) != mesh_checksum(mesh):
        raise InputError(
            "belongs to another mesh; expected the mesh of the fit, which may have changed since; "
            "fit again",
            file=path,
        )
    divisions = int(stored["divisions"])
    if not 1 <= divisions <= MAX_DIVISIONS:
        raise ValueError(f"{divisions} divisions of a face")
    grid = SurfaceGrid.of(mesh, divisions)
    n = len(grid)
    if declared > n * (4 * COUNT + 2) + len(mesh.faces) + MAX_OTHER_BYTES:
        raise ValueError("more values than nodes")
    parameters, deviation = (
        np.nan_to_num(stored[key].astype(np.float32)) for key in ("parameters", "deviation")
    )
    photos, face_material = stored["photos"], stored["face_material"]
    kinds = tuple(
        MaterialVariation(str(entry["kind"]), dict(entry["cost"]), dict(entry["typical"]))
        for entry in json.loads(str(stored["materials"]))
    )
    if parameters.shape != (n, COUNT) or deviation.shape != (n, COUNT) or photos.shape != (n,):
        raise ValueError("arrays of other sizes than the mesh")
    if face_material.shape != (len(mesh.faces),) or face_material.max(initial=0) >= materials:
        raise ValueError("faces of other materials than those of the result")
    if len(kinds) != materials or any(kind.kind not in VARIATIONS for kind in kinds):
        raise ValueError("other materials than those of the result")
    return VaryingSurface(
        grid,
        np.clip(parameters, -LIMITS, LIMITS),
        deviation,
        photos.astype(np.uint16),
        face_material.astype(np.uint8),
        kinds,
    )
