"""The part of a photo that can show the mesh; no rays are cast elsewhere.

The mesh is enclosed in cells of a coarse lattice. A cell is convex, so a pinhole or orthographic
camera sees it within the rectangle around its projected corners. A lens with distortion bends the
edges of the cell, by much less than the size of the rectangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera, Mesh

CELLS = 64  # lattice cells along each axis of the bounding box
ROWS = 16  # pixel rows that share one range of columns
RELATIVE_MARGIN, MARGIN_PIXELS = (
    0.25,
    2.0,
)  # margin on every side of a rectangle: fraction of its size, plus pixels
CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])


@dataclass(frozen=True)
class Cover:
    """The lattice cells that hold the mesh. points: (p, 3) corners of all cells, scan frame;
    corners: (c, 8) indices into points of each cell's corners."""

    points: NDArray[np.float64]
    corners: NDArray[np.intp]

    @classmethod
    def of(cls, mesh: Mesh) -> Cover:
        """The cells that the bounding boxes of the faces touch."""
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        edge = np.maximum((high - low) * (1 + 1e-6), 1e-30) / CELLS
        cell = np.clip(((mesh.vertices - low) / edge).astype(np.int32), 0, CELLS - 1)
        first = second = None
        for k in range(3):
            corner = cell.take(mesh.faces[:, k], axis=0)
            first = corner if first is None else np.minimum(first, corner)
            second = corner if second is None else np.maximum(second, corner)
        assert first is not None and second is not None
        second += 1
        # add 1 to all cells of each box: differences at its corners, then cumulative sums
        side = CELLS + 1
        marks = np.zeros(side**3, np.int64)
        for pick in CORNERS:
            where = np.where(pick, second, first)
            flat = (where[:, 0] * side + where[:, 1]) * side + where[:, 2]
            count = np.bincount(flat, minlength=side**3)
            marks += count if pick.sum() % 2 == 0 else -count
        boxed = marks.reshape(side, side, side)
        for axis in range(3):
            boxed = boxed.cumsum(axis=axis)
        cells = np.argwhere(boxed > 0)
        flat = ((cells[:, None] + CORNERS) @ np.array([side * side, side, 1])).ravel()
        used, places = np.unique(flat, return_inverse=True)
        lattice = np.stack(np.unravel_index(used, (side, side, side)), axis=1)
        return cls(low + lattice * edge, places.reshape(-1, 8))

    def columns(self, camera: Camera) -> NDArray[np.int32]:
        """(blocks, 2) first column and last column + 1 that can show the mesh, for every ROWS rows
        of a photo; equal where no column can."""
        blocks = -(-camera.height // ROWS)
        everywhere = np.tile(np.array([[0, camera.width]], np.int32), (blocks, 1))
        if camera.panoramic:
            return everywhere
        corners = self.corners[camera.in_front(self.points)[self.corners].any(axis=1)]
        pixels = camera.project(self.points)
        if not np.isfinite(
            pixels[corners]
        ).all():  # at or behind the camera plane, or beyond a fold
            return everywhere
        low, high = pixels[corners].min(axis=1), pixels[corners].max(axis=1)
        margin = RELATIVE_MARGIN * (high - low) + MARGIN_PIXELS
        limits = np.array([camera.width, camera.height])
        first = np.clip(np.floor(low - margin), 0, limits).astype(np.int32)
        last = np.clip(np.ceil(high + margin), 0, limits).astype(np.int32)
        inside = (first < last).all(axis=1)
        first, last = first[inside], last[inside]
        found = np.stack([np.full(blocks, camera.width), np.zeros(blocks)], axis=1).astype(np.int32)
        block, end = first[:, 1] // ROWS, (last[:, 1] - 1) // ROWS
        while len(block):
            np.minimum.at(found[:, 0], block, first[:, 0])
            np.maximum.at(found[:, 1], block, last[:, 0])
            block = block + 1
            more = block <= end
            block, end, first, last = block[more], end[more], first[more], last[more]
        found[found[:, 0] >= found[:, 1]] = 0
        return found
