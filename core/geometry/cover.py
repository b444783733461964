"""Which part of a photo the mesh can be in: rays elsewhere are not worth casting.

The mesh is boxed into the cells of a coarse lattice. A cell is convex, so a pinhole sees it within
the rectangle around its corners; a lens with distortion bends the cell's edges, by much less than
the rectangle is large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera, Mesh

CELLS = 64  # along each axis
ROWS = 16  # of a photo that share one range of columns
SLACK, LEAST = 0.25, 2.0  # added to rectangles on every side: of their size, and pixels
CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])


@dataclass(frozen=True)
class Cover:
    """Cells of a lattice that hold the mesh. points: (p, 3) scan frame, the corners of all of them;
    corners: (c, 8) the places of each cell's corners among the points."""

    points: NDArray[np.float64]
    corners: NDArray[np.intp]

    @classmethod
    def of(cls, mesh: Mesh) -> Cover:
        """The cells that the boxes around the faces touch."""
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
        # a box adds 1 to its cells: differences at its corners, summed along the axes
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
        """(blocks, 2) first and last column + 1 of every ROWS rows of a photo outside of which the
        mesh cannot be; equal where it is in none."""
        blocks = -(-camera.height // ROWS)
        everywhere = np.tile(np.array([[0, camera.width]], np.int32), (blocks, 1))
        if camera.panoramic or camera.orthographic:
            return everywhere
        ahead = self.points @ camera.pose.rotation[2] + camera.pose.translation[2] > 0
        corners = self.corners[ahead[self.corners].any(axis=1)]
        pixels = camera.project(self.points)
        if not np.isfinite(pixels[corners]).all():  # beside or around the camera, or beyond a fold
            return everywhere
        low, high = pixels[corners].min(axis=1), pixels[corners].max(axis=1)
        slack = SLACK * (high - low) + LEAST
        limits = np.array([camera.width, camera.height])
        first = np.clip(np.floor(low - slack), 0, limits).astype(np.int32)
        last = np.clip(np.ceil(high + slack), 0, limits).astype(np.int32)
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
