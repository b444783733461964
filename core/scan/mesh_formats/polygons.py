"""What a mesh file says, before triangles are made of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .triangulate import ear_clip, is_convex, plane_coordinates

# no scan has such coordinates, in any unit; their squares and cubes are still numbers
LARGEST_COORDINATE = 1e12
MOST_CORNERS = 2**31 - 1  # they are numbered in 32 bits
MOST_OF_ONE = 100_000  # corners of one face
# pairs of corners of one polygon, over all polygons with dents: some seconds of work
MOST_PAIRS = 1 << 25
AT_ONCE = 1 << 18  # corners, or tests of a corner against one triangle


@dataclass(frozen=True)
class Polygons:
    """vertices: (v, 3) float64; corners: (c,) int64 vertex of every corner, polygon after polygon;
    sizes: (p,) int64 corners of each polygon; attributes: name → (p,) int32;
    vertex_colours: (v, 3) uint8 sRGB or None; corner_uv: (c, 2) float32, v upwards, or None;
    materials: names by the number in attributes["material"]; textures: a file for each of them;
    notes: what a user should know about the file, a sentence each."""

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
        """Raise InputError where the numbers cannot be those of a surface."""
        if not len(self.sizes):
            raise InputError(
                "the mesh has no faces (a point cloud?): export the surface", file=path
            )
        if len(self.corners) > MOST_CORNERS:
            raise InputError(
                f"has {len(self.corners)} corners of faces, expected at most {MOST_CORNERS}: "
                "reduce the mesh",
                file=path,
            )
        if self.sizes.max() > MOST_OF_ONE:
            raise InputError(
                f"a face has {self.sizes.max()} corners, expected at most {MOST_OF_ONE}: "
                "export triangles",
                file=path,
            )
        if self.corners.min() < 0 or self.corners.max() >= len(self.vertices):
            raise InputError("faces refer to vertices that are not there", file=path)
        if not np.isfinite(self.vertices).all():
            raise InputError("vertices are not finite numbers (NaN or infinite)", file=path)
        largest = max(float(self.vertices.max()), -float(self.vertices.min()))
        if largest > LARGEST_COORDINATE:
            raise InputError(
                f"a vertex has the coordinate {largest:.3g}; no scan is that far away: "
                "the file is damaged",
                file=path,
            )

    def triangles(self, path: Path) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Places in ``corners`` (t, 3) and the polygon (t,) of each triangle, in the polygons'
        order. Convex polygons become fans, others are cut at their ears. Raises InputError."""
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
        dented = self._dented(starts)
        bits = np.ceil(np.log2(self.sizes[dented])).astype(int)
        pairs = int(np.sum(4**bits))
        if pairs > MOST_PAIRS:
            raise InputError(
                f"{len(dented)} faces with up to {self.sizes[dented].max()} corners are not "
                "convex; those are too many to cut: export triangles",
                file=path,
            )
        for bit in np.unique(bits):
            widest = 1 << int(bit)
            all_of_it = dented[bits == bit]
            for begin in range(0, len(all_of_it), step := max(1, AT_ONCE // widest)):
                these = all_of_it[begin : begin + step]
                sizes = self.sizes[these]
                corner = np.minimum(np.arange(widest), sizes[:, None] - 1)
                rings = self.vertices[self.corners[starts[these, None] + corner]]
                local = ear_clip(plane_coordinates(rings), sizes)
                valid = np.arange(widest - 2) < counts[these, None]
                row = (first[these, None] + np.arange(widest - 2))[valid]
                places[row] = (starts[these, None, None] + local)[valid]
        return places, owner

    def _dented(self, starts: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers of the polygons that are not convex."""
        found = [np.empty(0, np.int64)]
        for size in np.unique(self.sizes[self.sizes > 3]):
            these = np.flatnonzero(self.sizes == size)
            for begin in range(0, len(these), step := max(1, AT_ONCE // int(size))):
                part = these[begin : begin + step]
                rings = self.vertices[self.corners[starts[part, None] + np.arange(size)]]
                found.append(part[~is_convex(plane_coordinates(rings))])
        return np.concatenate(found)
