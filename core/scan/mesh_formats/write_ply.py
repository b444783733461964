"""Writer for binary PLY, with texture coordinates at the vertices, as Blender and MeshLab read
them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .distinct import distinct_rows


def write_ply(
    path: Path,
    vertices: NDArray[np.floating],
    faces: NDArray[np.integer],
    uv: NDArray[np.floating] | None = None,
) -> None:
    """Write triangles. vertices: (v, 3); faces: (f, 3); uv: (f, 3, 2) of their corners, or None.
    Vertices at the seams of the texture are written once for each of their places in it."""
    names = ["x", "y", "z"]
    columns = [vertices.astype("<f4")]
    if uv is not None:
        names += ["s", "t"]
        place = np.ascontiguousarray(uv.reshape(-1, 2), np.float32)
        key = np.column_stack([faces.ravel(), place.view(np.int32)])
        first, corner = distinct_rows(key)
        columns = [columns[0][faces.ravel()[first]], place[first].astype("<f4")]
        faces = corner.reshape(-1, 3)
    points = np.concatenate(columns, axis=1)
    triangles = np.empty(len(faces), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    triangles["count"], triangles["corners"] = 3, faces
    header = [
        "ply", "format binary_little_endian 1.0", f"element vertex {len(points)}",
        *(f"property float {name}" for name in names), f"element face {len(faces)}",
        "property list uchar int vertex_indices", "end_header\n",
    ]  # fmt: skip
    with path.open("wb") as file:
        file.write("\n".join(header).encode("ascii"))
        file.write(points.tobytes())
        file.write(triangles.tobytes())
