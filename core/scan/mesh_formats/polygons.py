"""The content of a mesh file before triangulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .triangulate import ear_clip, is_convex, plane_coordinates

# above the coordinates of any scan, in any unit; squares and cubes still fit into a double
MAX_COORDINATE = 1e12
MAX_CORNERS = 2**31 - 1  # indices have 32 bits
MAX_FACE_CORNERS = 100_000  # corners of one face
# pairs of corners within a polygon, over all non-convex polygons: some seconds of work
MAX_CORNER_PAIRS = 1 << 25
BLOCK = 1 << 18  # corners, or tests of a corner against a triangle, processed together


@dataclass(frozen=True)
class Polygons:
    """vertices: (v, 3) float64; corners: (c,) int64 vertex of every corner, polygon after polygon;
    sizes: (p,) int64 number of corners of each polygon; attributes: name → (p,) int32;
    vertex_colours: (v, 3) uint8 sRGB or None; corner_uv: (c, 2) float32, v upwards, or None;
    materials: names, indexed by attributes["material"]; textures: a file for each material; notes:
    sentences about the file for the user."""

    vertices: NDArray[np.float64]
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    attributes: dict[str, NDArray[np.int32]] = field(default_factory=dict)
    vertex_colours: NDArray[np.uint8] | None = None
    corner_uv: NDArray[np.float32] | None = None
    materials: tuple[str, ...] = ()
    textures: tuple[Path | None, ...] = ()
    notes: tuple[str, ...] = ()

    def check(self, path: Path) -> None:
        """Raise InputError where the values cannot be those of a surface."""
        if not len(self.sizes):
            raise InputError(
                "the mesh has no faces (is it a point cloud?); export the surface", file=path
            )
        if len(self.corners) > MAX_CORNERS:
            raise InputError(
                f"has {len(self.corners)} face corners; expected at most {MAX_CORNERS}; "
                "reduce the mesh",
                file=path,
            )
        if self.sizes.max() > MAX_FACE_CORNERS:
            raise InputError(
                f"a face has {self.sizes.max()} corners; expected at most {MAX_FACE_CORNERS}; "
                "export triangles",
                file=path,
            )
        if self.corners.min() < 0 or self.corners.max() >= len(self.vertices):
            raise InputError("faces refer to missing vertices; the file is damaged", file=path)
        if not np.isfinite(self.vertices).all():
            raise InputError(
                "some vertices are NaN or infinite; expected finite coordinates", file=path
            )
        largest = max(float(self.vertices.max()), -float(self.vertices.min()))
        if largest > MAX_COORDINATE:
            raise InputError(
                f"a vertex has the coordinate {largest:.3g}; expected at most 1e12: "
                "the file is damaged",
                file=path,
            )

    def triangles(self, path: Path) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(t, 3) indices into ``corners`` and (t,) the polygon of each triangle, in the polygons'
        order. Convex polygons are split into fans, others by ear clipping. Raises InputError."""
        if (self.sizes == 3).all():
            places = np.arange(3 * len(self.sizes), dtype=np.int32).reshape(-1, 3)
            return places, np.arange(len(self.sizes), dtype=np.int32)
        starts = np.cumsum(self.sizes) - self.sizes
        counts = self.sizes - 2
        first = np.cumsum(counts) - counts
        owner = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        places = np.empty((len(owner), 3), np.int32)
        places[:, 0] = np.repeat(starts, counts)
        places[:, 1] = np.repeat(starts - first + 1, counts) + np.arange(len(owner))
        places[:, 2] = places[:, 1] + 1
        non_convex = self._non_convex(starts)
        bits = np.ceil(np.log2(self.sizes[non_convex])).astype(int)
        pairs = int(np.sum(4**bits))
        if pairs > MAX_CORNER_PAIRS:
            raise InputError(
                f"{len(non_convex)} faces with up to {self.sizes[non_convex].max()} corners "
                "are not "
                "convex, which are too many to triangulate; export triangles",
                file=path,
            )
        for bit in np.unique(bits):
            widest = 1 << int(bit)
            same_size = non_convex[bits == bit]
            for begin in range(0, len(same_size), step := max(1, BLOCK // widest)):
                these = same_size[begin : begin + step]
                sizes = self.sizes[these]
                corner = np.minimum(np.arange(widest), sizes[:, None] - 1)
                rings = self.vertices[self.corners[starts[these, None] + corner]]
                local = ear_clip(plane_coordinates(rings), sizes)
                valid = np.arange(widest - 2) < counts[these, None]
                row = (first[these, None] + np.arange(widest - 2))[valid]
                places[row] = (starts[these, None, None] + local)[valid]
        return places, owner

    def _non_convex(self, starts: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices of the polygons that are not convex."""
        found = [np.empty(0, np.int64)]
        for size in np.unique(self.sizes[self.sizes > 3]):
            these = np.flatnonzero(self.sizes == size)
            for begin in range(0, len(these), step := max(1, BLOCK // int(size))):
                part = these[begin : begin + step]
                rings = self.vertices[self.corners[starts[part, None] + np.arange(size)]]
                found.append(part[~is_convex(plane_coordinates(rings))])
        return np.concatenate(found)
