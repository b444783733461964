"""Ray casting against the scanned mesh: Embree, vectorised, in chunks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from ..scan import Mesh

CHUNK = 1 << 20  # rays at once: 24 M rays with their results would take over 2 GB


class Hits(NamedTuple):
    """Where rays meet the mesh first. face: (n,) int32, -1 for none; u, v: (n,) float32 weights of
    the face's second and third vertex."""

    face: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]


@dataclass(frozen=True)
class RayScene:
    """A mesh ready for rays. Embree works in float32: everything is shifted to the mesh's centre,
    so that georeferenced coordinates lose nothing."""

    mesh: Mesh
    origin: NDArray[np.float64]
    scene: EmbreeScene

    @classmethod
    def build(cls, mesh: Mesh) -> RayScene:
        origin = mesh.vertices[mesh.faces[:, 0]].mean(axis=0)
        scene = EmbreeScene()
        triangles = (mesh.vertices - origin).astype(np.float32)[mesh.faces]
        TriangleMesh(scene, np.ascontiguousarray(triangles))
        return cls(mesh, origin, scene)

    def first_hits(self, start: NDArray[np.float64], directions: NDArray[np.float64]) -> Hits:
        """First hits of rays along ``directions`` (n, 3) from one point ``start`` (3,), or from a
        point each (n, 3)."""
        n = len(directions)
        face = np.empty(n, np.int32)
        u, v = np.empty(n, np.float32), np.empty(n, np.float32)
        local = (start - self.origin).astype(np.float32)
        for begin in range(0, n, CHUNK):
            part = slice(begin, min(begin + CHUNK, n))
            along = np.ascontiguousarray(directions[part], np.float32)
            begins = np.broadcast_to(local if local.ndim == 1 else local[part], along.shape)
            found = self.scene.run(np.ascontiguousarray(begins), along, output=True)
            face[part], u[part], v[part] = found["primID"], found["u"], found["v"]
        return Hits(face, u, v)

    def occluded(
        self,
        points: NDArray[np.float64],
        directions: NDArray[np.float64],
        limits: NDArray[np.float64] | None = None,
    ) -> NDArray[np.bool_]:
        """(n,) whether anything lies from ``points`` (n, 3) along unit ``directions``, (3,) or
        (n, 3), nearer than ``limits`` (n,) where given."""
        blocked = np.empty(len(points), bool)
        for begin in range(0, len(points), CHUNK):
            part = slice(begin, begin + CHUNK)
            start = np.ascontiguousarray(points[part] - self.origin, np.float32)
            one = directions if directions.ndim == 1 else directions[part]
            along = np.ascontiguousarray(np.broadcast_to(one, start.shape), np.float32)
            far = None if limits is None else np.ascontiguousarray(limits[part], np.float32)
            found = self.scene.run(start, along, far, query="OCCLUDED")
            blocked[part] = np.asarray(found) >= 0
        return blocked

    def just_before(
        self, start: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(n, 3) ``start`` moved along ``directions`` (n, 3) to just before the mesh: rays without
        a camera's centre may start anywhere, and Embree's float32 wants them to start near."""
        along = np.einsum("ij,ij->i", self.origin - start, directions) - self.mesh.size
        return start + along[:, None] * directions

    def points(self, hits: Hits) -> NDArray[np.float64]:
        """(n, 3) surface points of hits (all must hit)."""
        return self._blend(self.mesh.vertices, hits)

    def normals(self, hits: Hits) -> NDArray[np.float64]:
        """(n, 3) unit smooth normals at hits (all must hit)."""
        normals = self._blend(self.mesh.vertex_normals, hits)
        return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)

    def _blend(self, per_vertex: NDArray[np.float64], hits: Hits) -> NDArray[np.float64]:
        a, b, c = (per_vertex[self.mesh.faces[hits.face, k]] for k in range(3))
        u, v = hits.u[:, None].astype(np.float64), hits.v[:, None].astype(np.float64)
        return a * (1.0 - u - v) + b * u + c * v
