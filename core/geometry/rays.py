"""Ray casting against the scanned mesh with Embree, vectorised, in chunks."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from ..angles.vectors import length
from ..scan import Mesh
from .cover import Cover
from .embree_tree import EmbreeTree
from .lift import SHADOW_LIFT, facet_lift

CHUNK_RAYS = 1 << 20  # bounds memory: 24 M rays with their results would take over 2 GB


class Hits(NamedTuple):
    """First intersections of rays with the mesh. face: (n,) int32, −1 for none; u, v: (n,) float32
    barycentric weights of the face's second and third vertex; distance: (n,) float32 along the ray,
    scan units."""

    face: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    distance: NDArray[np.float32] | None = None

    def select(self, which: NDArray) -> Hits:
        """The hits of a boolean mask or an index array, without distances."""
        return Hits(self.face[which], self.u[which], self.v[which])


@dataclass(frozen=True)
class RayScene:
    """A mesh prepared for ray casting. Embree works in float32, so everything is relative to the
    mesh's centre, which keeps the precision of georeferenced coordinates. lift: distance of shadow
    rays' starts from the surface, scan units."""

    STORED_APART: ClassVar[bool] = True

    mesh: Mesh
    origin: NDArray[np.float64]
    tree: EmbreeTree
    lift: float

    @classmethod
    def build(cls, mesh: Mesh) -> RayScene:
        origin = mesh.vertices[mesh.faces[:, 0]].mean(axis=0)
        tree = EmbreeTree(mesh, origin)
        _ = tree.scene  # builds it here, before threads use it
        return cls(mesh, origin, tree, SHADOW_LIFT * mesh.size)._ready()

    @property
    def scene(self) -> EmbreeScene:
        """Embree's scene."""
        return self.tree.scene

    def __getstate__(self) -> dict[str, Any]:
        """The fields, without what is computed from them."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def close(self) -> RayScene:
        """The same scene with shadow rays that start as close to the surface as its facets
        allow."""
        return replace(self, lift=facet_lift(self.mesh))._ready()

    def _ready(self) -> RayScene:
        """Compute the cached properties before several threads use them."""
        _ = self._vertex_table, self._corners, self.cover
        return self

    def first_hits(self, start: NDArray[np.float64], directions: NDArray[np.floating]) -> Hits:
        """First hits of rays along ``directions`` (n, 3) from one point ``start`` (3,), or from a
        point each (n, 3)."""
        n = len(directions)
        face = np.empty(n, np.int32)
        u, v, distance = (np.empty(n, np.float32) for _ in range(3))
        local = (start - self.origin).astype(np.float32)
        for begin in range(0, n, CHUNK_RAYS):
            part = slice(begin, min(begin + CHUNK_RAYS, n))
            along = np.asarray(directions[part], np.float32)
            begins = np.broadcast_to(local if local.ndim == 1 else local[part], along.shape)
            found = self.scene.run(begins, along, output=True)
            face[part], u[part], v[part] = found["primID"], found["u"], found["v"]
            distance[part] = found["tfar"]
        return Hits(face, u, v, distance)

    def occluded(
        self,
        points: NDArray[np.float64],
        directions: NDArray[np.floating],
        limits: NDArray[np.floating] | None = None,
        lift: NDArray[np.floating] | None = None,
    ) -> NDArray[np.bool_]:
        """(n,) whether the mesh blocks rays from ``points`` (n, 3), offset by ``lift`` (n, 3) where
        given, along unit ``directions``, (3,) or (n, 3), within the distances ``limits`` (n,) where
        given."""
        blocked = np.empty(len(points), bool)
        same = directions.ndim == 1 or (len(directions) > 0 and directions.strides[0] == 0)
        one = np.array(directions if directions.ndim == 1 else directions[:1], np.float32)
        for begin in range(0, len(points), CHUNK_RAYS):
            part = slice(begin, begin + CHUNK_RAYS)
            start = (points[part] - self.origin).astype(np.float32)
            if lift is not None:
                start += lift[part]
            along = one.reshape(1, 3) if same else np.asarray(directions[part], np.float32)
            far = None if limits is None else np.ascontiguousarray(limits[part], np.float32)
            found = self.scene.run(start, along, far, query="OCCLUDED")
            blocked[part] = np.asarray(found) >= 0
        return blocked

    def just_before(
        self, start: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(n, 3) ``start`` moved along ``directions`` (n, 3) to just before the mesh, for rays
        without a camera centre: Embree's float32 needs near start points."""
        along = np.einsum("ij,ij->i", self.origin - start, directions) - self.mesh.size
        return start + along[:, None] * directions

    def points(self, hits: Hits) -> NDArray[np.float64]:
        """(n, 3) surface points of hits (all must hit)."""
        return self._blend(self.mesh.vertices, hits)

    def normals(self, hits: Hits) -> NDArray[np.float64]:
        """(n, 3) unit smooth normals at hits (all must hit)."""
        normals = self._blend(self.mesh.vertex_normals, hits)
        return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)

    def surface(self, hits: Hits) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """((3, n) points relative to ``origin``, (3, n) unit smooth normals) at hits (all must
        hit), in float32: the results of points() and normals() in a fifth of the time."""
        table, corners = self._vertex_table, self._corners
        second, third = hits.u, hits.v
        first = np.float32(1.0) - second - third
        out = np.empty((6, len(hits.face)), np.float32)
        for k, weight in enumerate((first, second, third)):
            vertex = corners[k].take(hits.face)
            for row in range(6):
                value = table[row].take(vertex)
                value *= weight
                if k == 0:
                    out[row] = value
                else:
                    out[row] += value
        normal = out[3:]
        normal /= np.maximum(length(*normal), np.float32(1e-12))
        return out[:3], normal

    @cached_property
    def cover(self) -> Cover:
        """The coarse cells that the mesh occupies."""
        return Cover.of(self.mesh)

    @cached_property
    def _vertex_table(self) -> NDArray[np.float32]:
        """(6, v) components of the vertices relative to ``origin``, and of their normals."""
        table = np.empty((6, len(self.mesh.vertices)), np.float32)
        table[:3] = (self.mesh.vertices - self.origin).T
        table[3:] = self.mesh.vertex_normals.T
        return table

    @cached_property
    def _corners(self) -> NDArray[np.int32]:
        """(3, f) the faces' first, second and third vertices."""
        return np.ascontiguousarray(self.mesh.faces.T)

    def _blend(self, per_vertex: NDArray[np.float64], hits: Hits) -> NDArray[np.float64]:
        a, b, c = (per_vertex[self.mesh.faces[hits.face, k]] for k in range(3))
        u, v = hits.u[:, None].astype(np.float64), hits.v[:, None].astype(np.float64)
        return a * (1.0 - u - v) + b * u + c * v
