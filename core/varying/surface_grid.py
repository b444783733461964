"""A grid of nodes on the mesh, finer than its vertices, that needs no texture coordinates.

Every face is divided into n × n equal triangles. The nodes are their corners: the vertices of the
mesh, n − 1 nodes on each edge, which the faces at the edge share, and the nodes inside the faces.
Between nodes, values are linear. (Mesh Colors, Yuksel, Keyser and House 2010.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..scan import Mesh

MAX_DIVISIONS = 2048
CHUNK = 1 << 18  # faces or points at once, to limit memory


@dataclass(frozen=True)
class SurfaceGrid:
    """mesh, divided n times. edge: (f, 3) int32, number of the edge between the first and second,
    second and third, third and first vertex of each face; edges: (e, 2) int32 their vertices, the
    smaller index first."""

    mesh: Mesh
    n: int
    edge: NDArray[np.int32]
    edges: NDArray[np.int32]

    @classmethod
    def of(cls, mesh: Mesh, n: int) -> SurfaceGrid:
        """Divide every face n times, 1 or more."""
        ends = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2)
        ends = np.sort(ends, axis=1)
        edges, edge = np.unique(ends, axis=0, return_inverse=True)
        return cls(mesh, n, edge.reshape(-1, 3).astype(np.int32), edges.astype(np.int32))

    @classmethod
    def with_nodes(cls, mesh: Mesh, count: int) -> SurfaceGrid:
        """The grid with about ``count`` nodes, at least the vertices of the mesh."""
        n = round(float(np.sqrt(2 * count / max(len(mesh.faces), 1))))
        return cls.of(mesh, min(max(n, 1), MAX_DIVISIONS))

    def __len__(self) -> int:
        return self._first_inner + len(self.mesh.faces) * self._inner

    @property
    def _inner(self) -> int:
        """Nodes inside a face."""
        return (self.n - 1) * (self.n - 2) // 2

    @property
    def _first_inner(self) -> int:
        return len(self.mesh.vertices) + len(self.edges) * (self.n - 1)

    def nodes(
        self, face: NDArray[np.integer], j: NDArray[np.integer], k: NDArray[np.integer]
    ) -> NDArray[np.int64]:
        """(m,) nodes at the lattice positions j, k of faces: the weights of the second and third
        vertex are j / n and k / n."""
        n, count = self.n, len(self.mesh.vertices)
        i = n - j - k
        # inside: rows of k = 1, 2, …, each with j = 1 … n − 1 − k
        before = (k - 1) * (n - 1) - (k - 1) * k // 2
        found = self._first_inner + face.astype(np.int64) * self._inner + before + j - 1
        for side, (zero, along) in enumerate(((k, j), (i, k), (j, i))):
            on = zero == 0
            a = self.mesh.faces[face[on], side]
            b = self.mesh.faces[face[on], (side + 1) % 3]
            step = along[on]
            step = np.where(a < b, step, n - step)
            number = count + self.edge[face[on], side].astype(np.int64) * (n - 1) + step - 1
            found[on] = np.where(along[on] == 0, a, np.where(along[on] == n, b, number))
        return found

    def at(
        self, face: NDArray[np.integer], second: NDArray[np.floating], third: NDArray[np.floating]
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """(nodes (m, 3), weights (m, 3)) that interpolate at points of faces, given by barycentric
        weights of their second and third vertex."""
        n = self.n
        x, y = np.clip(second, 0, 1) * n, np.clip(third, 0, 1) * n
        j = np.minimum(x.astype(np.int64), n - 1)
        k = np.minimum(y.astype(np.int64), n - 1 - j)
        fx = np.clip(x - j, 0, 1)
        fy = np.clip(y - k, 0, 1)
        far = (fx + fy > 1) & (j + k < n - 1)
        total = np.where(far, 1.0, np.maximum(fx + fy, 1.0))
        fx, fy = fx / total, fy / total
        one = np.where(far, 1, 0)
        node = np.stack(
            [
                self.nodes(face, j + one, k + one),
                self.nodes(face, np.where(far, j, j + 1), np.where(far, k + 1, k)),
                self.nodes(face, np.where(far, j + 1, j), np.where(far, k, k + 1)),
            ],
            axis=1,
        )
        weight = np.stack(
            [
                np.where(far, fx + fy - 1, 1 - fx - fy),
                np.where(far, 1 - fx, fx),
                np.where(far, 1 - fy, fy),
            ],
            axis=1,
        )
        return node, weight.astype(np.float32)

    @cached_property
    def small_faces(self) -> NDArray[np.int64]:
        """(f·n², 3) nodes of the small triangles of all faces, face after face, counter-clockwise
        from outside."""
        face = np.arange(len(self.mesh.faces))
        corners = [
            self.nodes(np.repeat(face, len(j)), np.tile(j, len(face)), np.tile(k, len(face)))
            for j, k in self._small_corners()
        ]
        return np.stack(corners, axis=1)

    def small_uv(self) -> NDArray[np.float32] | None:
        """(f·n², 3, 2) texture coordinates of their corners; None for a mesh without any."""
        uv = self.mesh.uv
        if uv is None:
            return None
        found = []
        for j, k in self._small_corners():
            second, third = (a[None, :, None] / self.n for a in (j, k))
            a, b, c = (uv[:, None, side].astype(np.float64) for side in range(3))
            found.append((a * (1 - second - third) + b * second + c * third).reshape(-1, 2))
        return np.stack(found, axis=1).astype(np.float32)

    def _small_corners(self) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Lattice positions j, k (n²,) of the three corners of the small triangles of a face."""
        n = self.n
        j, k = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        up, down = j + k < n, j + k < n - 1  # the triangle at j, k, and the one beyond its diagonal
        shifts = (((0, 0), (1, 0)), ((1, 0), (1, 1)), ((0, 1), (0, 1)))
        return [
            (
                np.concatenate([j[up] + first[0], j[down] + second[0]]),
                np.concatenate([k[up] + first[1], k[down] + second[1]]),
            )
            for first, second in shifts
        ]

    @cached_property
    def places(self) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
        """(face, weight of its second vertex, of its third) of every node, one face of those that
        share it; −1 for vertices without a face."""
        face = np.full(len(self), -1, np.int32)
        second, third = np.zeros(len(self), np.float32), np.zeros(len(self), np.float32)
        j, k = np.mgrid[: self.n + 1, : self.n + 1].reshape(2, -1)
        inside = j + k <= self.n
        j, k = j[inside], k[inside]
        step = max(1, CHUNK // len(j))
        for begin in range(0, len(self.mesh.faces), step):
            some = np.arange(begin, min(begin + step, len(self.mesh.faces)))
            which = np.repeat(some, len(j))
            at_j, at_k = np.tile(j, len(some)), np.tile(k, len(some))
            node = self.nodes(which, at_j, at_k)
            face[node] = which
            second[node], third[node] = at_j / self.n, at_k / self.n
        return face, second, third

    def points(self, rows: slice | NDArray) -> NDArray[np.float64]:
        """(m, 3) nodes, scan frame."""
        return self._blend(self.mesh.vertices, rows)

    def normals(self, rows: slice | NDArray) -> NDArray[np.float64]:
        """(m, 3) unit smooth normals at nodes."""
        found = self._blend(self.mesh.vertex_normals, rows)
        return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)

    def _blend(self, values: NDArray, rows: slice | NDArray) -> NDArray[np.float64]:
        face, x, y = self.places
        a, b, c = (values[self.mesh.faces[face[rows], side]] for side in range(3))
        # exact multiples of 1 / n, so that nodes on both sides of a seam have one place
        second, third = (np.rint(w[rows, None] * np.float64(self.n)) / self.n for w in (x, y))
        return np.asarray(a * (1 - second - third) + b * second + c * third)

    @cached_property
    def mesh_edge(self) -> float:
        """Mean length of an edge of the mesh, scan units."""
        first, second = self.mesh.vertices[self.edges.T]
        return float(np.linalg.norm(second - first, axis=1).mean())

    @cached_property
    def spacing(self) -> float:
        """Root mean area of a node's surroundings, scan units."""
        return float(np.sqrt(self.mesh.area / max(len(self), 1)))
