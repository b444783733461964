"""A surface whose reflectance and normals vary: parameters of the materials at the nodes of a
grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..geometry import SurfaceView
from ..samples.take import Lighting
from ..scan import Mesh
from .node_model import NodeModel, Shading, tilted
from .surface_grid import SurfaceGrid

MIN_WEIGHT = 1e-3  # of the nodes of a face's own material, at a point that they determine
EVEN = "even"
VARIATIONS: dict[str, tuple[int, ...]] = {
    EVEN: (),
    "diffuse": (0, 1, 2),
    "diffuse and normals": (0, 1, 2, 5, 6, 7),
    "diffuse, specular, gloss and normals": (0, 1, 2, 3, 4, 5, 6, 7, 8, 9),
}
"""What may vary over a material → the parameters of its nodes (node_model.py), simplest first."""
ALL_VARIATIONS = tuple(VARIATIONS)[-1]


@dataclass(frozen=True)
class MaterialVariation:
    """What varies over one material. kind: a key of VARIATIONS. cost: kind → mean cost of held-out
    photos, in nats a pixel; typical: kind → median relative error of their radiance. Both are empty
    where nothing was held out."""

    kind: str
    cost: dict[str, float] = field(default_factory=dict)
    typical: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class VaryingSurface:
    """grid: of the nodes. parameters: (n, 10) float32; deviation: (n, 10) float32, their standard
    errors; photos: (n,) uint16, number of photos that show the node lit. face_material: (f,) uint8,
    index of the material of each face of the mesh. materials: in the order of the capture.
    separated_from: the material of the capture that they are parts of, None where they are those of
    the capture; result.json has it."""

    grid: SurfaceGrid
    parameters: NDArray[np.float32]
    deviation: NDArray[np.float32]
    photos: NDArray[np.uint16]
    face_material: NDArray[np.uint8]
    materials: tuple[MaterialVariation, ...]
    separated_from: str | None = None

    @property
    def varies(self) -> bool:
        """Whether any material is not even."""
        return any(material.kind != EVEN for material in self.materials)

    def at(
        self, face: NDArray[np.integer], second: NDArray[np.floating], third: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """(m, 10) parameters at points of faces, given by barycentric weights of their second and
        third vertex."""
        node, weight = self.interpolation(face, second, third)
        return np.einsum("mk,mkc->mc", weight, self.parameters[node])

    def interpolation(
        self, face: NDArray[np.integer], second: NDArray[np.floating], third: NDArray[np.floating]
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """(nodes (m, 3), weights (m, 3)) that interpolate at points of faces, as of SurfaceGrid.at.
        A node between faces of two materials has parameters of one of them, so nodes of another
        material than the face's have no weight where there is one of its own."""
        node, weight = self.grid.at(face, second, third)
        if len(self.materials) > 1:
            own = self._node_material[node] == self.face_material[face][:, None]
            kept = weight * own
            total = kept.sum(axis=1, keepdims=True)
            weight = np.where(total > MIN_WEIGHT, kept / np.maximum(total, MIN_WEIGHT), weight)
        return node, weight

    @cached_property
    def _node_material(self) -> NDArray[np.uint8]:
        """(n,) material of each node, that of one of its faces."""
        return self.face_material[np.maximum(self.grid.places[0], 0)]


def predict_varying(
    view: SurfaceView,
    lighting: Lighting,
    surface: VaryingSurface,
    parts: Sequence[tuple[NDArray[np.bool_], NodeModel]],
) -> NDArray[np.float32]:
    """(n, 3) radiance of a view's pixels: 0 in shadow, NaN where no material was fitted.

    parts: ((n,) pixels of the view, model) of every material."""
    values = np.full((len(view.pixel), 3), np.nan, np.float32)
    for pixels, model in parts:
        values[pixels] = 0.0
        lit = np.flatnonzero(pixels & ~lighting.shadowed)
        face = view.face[lit]
        second, third = barycentric(surface.grid.mesh, face, view.point[lit])
        parameters = surface.at(face, second, third)
        light = lighting.incidence.select(lit)
        shape = len(lit), 3
        normal = np.asarray(view.normal[lit], np.float32)
        towards = np.broadcast_to(light.towards, shape).astype(np.float32)
        shading = Shading(
            towards,
            np.asarray(view.view[lit], np.float32),
            np.broadcast_to(light.irradiance, shape).astype(np.float32),
        )
        facing = np.einsum("ij,ij->i", tilted(normal, parameters), towards) > 0
        radiance = model.radiance(shading, normal, parameters)
        values[lit] = np.where(facing[:, None], radiance, 0.0)
    return values


def barycentric(
    mesh: Mesh, face: NDArray[np.integer], points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weights (m,) of the second and third vertex of faces at points (m, 3) on them."""
    a, b, c = (mesh.vertices[mesh.faces[face, k]] for k in range(3))
    first, second, away = b - a, c - a, points - a
    d11, d12, d22, p1, p2 = (
        np.einsum("ij,ij->i", u, v)
        for u, v in (
            (first, first), (first, second), (second, second), (away, first), (away, second),
        )
    )  # fmt: skip
    area = np.maximum(d11 * d22 - d12**2, 1e-300)
    return (d22 * p1 - d12 * p2) / area, (d11 * p2 - d12 * p1) / area
