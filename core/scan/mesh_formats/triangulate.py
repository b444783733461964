"""Triangulate many polygons at once by ear clipping.

Ear clipping: Meisters, "Polygons have ears", American Mathematical Monthly 82(6), 1975. When an ear
is cut, only its two neighbours change: O'Rourke, "Computational Geometry in C", 1998.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CUT_SCORE = -4.0  # score of a removed corner; other scores are between -3 and 1
NO_EAR_OFFSET = -2.0  # added to the score of a corner that is not an ear


def plane_coordinates(rings: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, n, 2) corners of polygons (m, n, 3) in their mean planes, counter-clockwise.

    The plane's normal is Newell's (Sutherland, Sproull & Schumacker 1974).
    """
    local = rings - rings[:, :1]
    normal = np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 0, normal / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])
    other = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    x = np.cross(other, normal)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(normal, x)
    return np.stack([np.einsum("mnk,mk->mn", local, a) for a in (x, y)], axis=-1)


def is_convex(flat: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(m,) whether counter-clockwise polygons (m, n, 2) turn left at every corner, within 1e-9."""
    before = flat - np.roll(flat, 1, axis=1)
    turn = _cross(before, np.roll(before, -1, axis=1))
    tolerance = 1e-9 * np.max(np.sum(before**2, axis=2), axis=1)
    return np.asarray((turn >= -tolerance[:, None]).all(axis=1))


def ear_clip(flat: NDArray[np.float64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, n − 2, 3) triangles of counter-clockwise simple polygons; each uses the first ``sizes``
    (m,) of its corners (m, n, 2). For a polygon of s corners the first s − 2 rows are valid.

    The ear nearest to an equilateral triangle is cut first. Where a self-intersecting polygon has
    no ear, the most convex corner is cut.
    """
    triangles = np.zeros((len(flat), flat.shape[1] - 2, 3), np.int64)
    _Rings(flat, sizes).clip(triangles)
    return triangles


class _Rings:
    """Polygons as linked lists of the remaining corners, with a score for each corner."""

    def __init__(self, flat: NDArray[np.float64], sizes: NDArray[np.int64]) -> None:
        m, n = flat.shape[:2]
        self.flat, self.left = flat, sizes.copy()
        place = np.arange(n)
        self.there = place < sizes[:, None]
        self.before = np.where(place > 0, place - 1, sizes[:, None] - 1)
        self.after = np.where(place < sizes[:, None] - 1, place + 1, 0)
        self.score = np.full((m, n), CUT_SCORE)
        rows = np.arange(m)
        for k in range(n):
            self._rate(rows[self.there[:, k]], np.full(int(self.there[:, k].sum()), k))

    def clip(self, triangles: NDArray[np.int64]) -> None:
        """Fill in all triangles."""
        rows = np.arange(len(self.flat))
        for cut in range(self.flat.shape[1] - 2):
            rows = rows[self.left[rows] > 2]
            ear = np.argmax(self.score[rows], axis=1)
            before, after = self.before[rows, ear], self.after[rows, ear]
            triangles[rows, cut] = np.stack([before, ear, after], axis=1)
            self.there[rows, ear] = False
            self.score[rows, ear] = CUT_SCORE
            self.left[rows] -= 1
            self.after[rows, before], self.before[rows, after] = after, before
            for neighbour in (before, after):
                self._rate(rows, neighbour)

    def _rate(self, rows: NDArray[np.intp], corner: NDArray[np.intp]) -> None:
        """Score one corner of each of those polygons: the shape of its triangle, lowered where it
        is not an ear."""
        b = self.flat[rows, corner]
        a, c = (self.flat[rows, link[rows, corner]] for link in (self.before, self.after))
        area = _cross(b - a, c - b)
        edges = sum(np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a)))
        shape = area / np.maximum(edges, 1e-300)
        ear = area > 0
        these = np.flatnonzero(ear)
        ear[these] = ~self._holds_a_corner(rows[these], a[these], b[these], c[these])
        self.score[rows, corner] = np.where(ear, 0.0, NO_EAR_OFFSET) + shape

    def _holds_a_corner(
        self,
        rows: NDArray[np.intp],
        a: NDArray[np.float64],
        b: NDArray[np.float64],
        c: NDArray[np.float64],
    ) -> NDArray[np.bool_]:
        """Whether those triangles contain another corner of their polygons."""
        x, y = self.flat[rows, :, 0], self.flat[rows, :, 1]
        inside = self.there[rows]
        for p, q in ((a, b), (b, c), (c, a)):
            along = q - p
            inside &= (along[:, :1] * (y - p[:, 1:]) - along[:, 1:] * (x - p[:, :1])) >= 0
        for p in (a, b, c):  # its own corners, and others at the same place
            inside &= (x != p[:, :1]) | (y != p[:, 1:])
        return np.asarray(inside.any(axis=1))


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
