"""A normal map, estimated from the photos given the BRDF.

The estimator corrects the normals of the scan, one correction for each surface patch
(core/fit/measured/normals.py). Here the same corrections are computed from samples with the colour
variation removed. They are interpolated between the centres of the patches. The normal of each
texel is written in its tangent frame: red along increasing u, green along increasing v, blue along
the smooth normal, as in glTF and Blender's Normal Map node.

The tangent at a vertex is the mean of ∂P/∂u over the faces of one UV island, weighted by the angles
of their corners and orthogonalised to the normal. This is MikkTSpace except for the order of the
sums. The corrections are a few degrees, so an error of one degree in a tangent is of second order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..basis.log_table import LogTable
from ..fit.measured.normals import refine_normals
from ..fit.measured.patches import Patches
from ..samples import SampleTable
from ..scan import Mesh
from .level import MaterialLevel
from .texels import Texels

Array = NDArray[np.float64]

NEIGHBOUR_PATCHES = 6  # patches that the correction of a texel is interpolated from
MAX_DISTANCE = 3.0  # in patch sizes: patches farther away have no influence
MIN_SAMPLES = 50  # of a material
MAX_SAMPLES = 1_000_000  # of a material; a regular subset is used of more
CHUNK = 1 << 17  # texels processed at once, to limit memory


@dataclass(frozen=True)
class TurnedNormals:
    """Corrections of the normals of p surface patches. points: (p, 3) their centres, scan frame;
    turn: (p, 3) vectors that are added to the unit normals of the scan; size: edge length of a
    patch, scan units."""

    points: Array
    turn: Array
    size: float

    @classmethod
    def of(
        cls, tables: Sequence[SampleTable], levels: Sequence[MaterialLevel]
    ) -> TurnedNormals | None:
        """Estimate the corrections from samples with the colour variation removed, one table for
        each material. None if no material has MIN_SAMPLES."""
        points: list[Array] = []
        turns: list[Array] = []
        sizes = []
        for table, level in zip(tables, levels, strict=True):
            if len(table) < MIN_SAMPLES:
                continue
            step = -(-len(table) // MAX_SAMPLES)
            some = table if step == 1 else table.select(np.arange(0, len(table), step))
            patches = Patches.of_points(some.point)
            brdf = LogTable.of(level.brdf.basis, level.brdf.coefficients)
            found = refine_normals(some, patches, brdf, level.normal_error)
            count = np.bincount(patches.of, minlength=patches.count)
            for values, out in (
                (some.point, points),
                (found.table.normal.astype(np.float64) - some.normal, turns),
            ):
                sums = [np.bincount(patches.of, v, patches.count) for v in values.T]
                out.append(np.stack(sums, axis=1) / count[:, None])
            sizes.append(patches.size)
        if not points:
            return None
        return cls(np.concatenate(points), np.concatenate(turns), float(np.max(sizes)))

    def at_texels(self, mesh: Mesh, texels: Texels, part: slice) -> Array:
        """(m, 3) corrected unit normals of the texels ``part``."""
        return self.at(texels.points(mesh, part), texels.normals(mesh, part))

    def at(self, points: Array, normals: Array) -> Array:
        """(n, 3) corrected unit normals at points (n, 3) with the smooth normals ``normals`` (n,
        3)."""
        out = np.empty_like(normals)
        tree, count = cKDTree(self.points), min(NEIGHBOUR_PATCHES, len(self.points))
        for begin in range(0, len(points), CHUNK):
            part = slice(begin, begin + CHUNK)
            away, near = tree.query(points[part], k=count)
            away = away.reshape(-1, count) / self.size
            weight = np.exp(-0.5 * away**2) * (away < MAX_DISTANCE)
            # texels far from all patches keep their normals
            total = np.maximum(weight.sum(axis=1, keepdims=True), 0.2)
            turn = np.einsum("nk,nkc->nc", weight / total, self.turn[near.reshape(-1, count)])
            normal = normals[part]
            turn -= np.einsum("nc,nc->n", turn, normal)[:, None] * normal
            out[part] = _unit(normal + turn)
        return out


def tangent_normals(
    mesh: Mesh, texels: Texels, normals: Callable[[slice], Array]
) -> NDArray[np.float32]:
    """(n, 3) corrected unit normals of all texels in their tangent frames; (0, 0, 1) is the smooth
    normal of the mesh. normals: function that returns them in the scan frame for a part."""
    corner, tangents, sign = corner_tangents(mesh)
    out = np.empty((len(texels), 3), np.float32)
    for begin in range(0, len(texels), CHUNK):
        part = slice(begin, min(begin + CHUNK, len(texels)))
        normal = texels.normals(mesh, part)
        face = texels.face[part]
        second, third = (w[part, None].astype(np.float64) for w in (texels.second, texels.third))
        a, b, c = (tangents[corner[face, k]] for k in range(3))
        tangent = (1 - second - third) * a + second * b + third * c
        tangent -= np.einsum("nc,nc->n", tangent, normal)[:, None] * normal
        tangent = _unit(tangent)
        other = sign[face, None] * np.cross(normal, tangent)
        found = normals(part)
        frame = np.stack([tangent, other, normal], axis=1)
        out[part] = np.einsum("nij,nj->ni", frame, found)
    return out


def corner_tangents(mesh: Mesh) -> tuple[NDArray[np.int64], Array, Array]:
    """((f, 3) index of the tangent of each corner of each face, (t, 3) unit tangents, (f,) +1, or
    −1 for faces that are mirrored in the texture). Corners with the same vertex, texture
    coordinates and handedness share a tangent."""
    assert mesh.uv is not None
    uv = mesh.uv.astype(np.float64)
    point = mesh.vertices[mesh.faces]
    first, second = point[:, 1] - point[:, 0], point[:, 2] - point[:, 0]
    u1, v1 = (uv[:, 1] - uv[:, 0]).T
    u2, v2 = (uv[:, 2] - uv[:, 0]).T
    area = u1 * v2 - u2 * v1
    sign = np.where(area < 0, -1.0, 1.0)
    along = _unit(sign[:, None] * (v2[:, None] * first - v1[:, None] * second))
    key = np.column_stack(
        [mesh.faces.ravel(), mesh.uv.reshape(-1, 2).view(np.int32), np.repeat(sign, 3)]
    )
    _, corner = np.unique(key, axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    sums = np.zeros((int(corner.max()) + 1, 3))
    for k in range(3):
        a = _unit(point[:, (k + 1) % 3] - point[:, k])
        b = _unit(point[:, (k + 2) % 3] - point[:, k])
        angle = np.arccos(np.clip(np.einsum("nc,nc->n", a, b), -1, 1))
        for axis in range(3):
            sums[:, axis] += np.bincount(corner[:, k], angle * along[:, axis], len(sums))
    return corner.astype(np.int64), _unit(sums), sign


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-30)
