"""The variation at the nodes of a surface, at the pixels of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..diagnose.forward.known_variation import KnownVariation, VariationAtPixels
from ..diagnose.forward.pixels import Pixels
from .choice import Nodes
from .node_model import TILT, NodeModel, Shading, tilted

NEAREST = 3  # nodes that a pixel's parameters are interpolated from, as in a triangle
NORMAL_SCALE = 0.05  # spacings a unit of the normal: separates the sides of a thin wall
MIN_DISTANCE = 1e-3  # spacings, so that a pixel at a node has finite weights
CHUNK = 1 << 17  # pixels at once, to limit memory


@dataclass(frozen=True)
class MaterialNodes:
    """The nodes of one material. model: of its BRDF in the unit of the diagnosis; parameters:
    (n, 10)."""

    nodes: Nodes
    model: NodeModel
    parameters: NDArray[np.float32]

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(_places(self.nodes.points, self.nodes.normals, self.nodes.spacing))

    def at(self, points: NDArray[np.float64], normals: NDArray[np.floating]) -> NDArray[np.float32]:
        """(m, 10) parameters at points (m, 3) with normals (m, 3), weighted by inverse distances to
        the nearest nodes of the same side of the surface."""
        unit = self.nodes.spacing
        out = np.empty((len(points), self.parameters.shape[1]), np.float32)
        nearest = min(NEAREST, len(self.parameters))
        for begin in range(0, len(points), CHUNK):
            part = slice(begin, begin + CHUNK)
            away, node = self._tree.query(_places(points[part], normals[part], unit), nearest)
            away, node = away.reshape(-1, nearest), node.reshape(-1, nearest)
            weight = 1 / (away + MIN_DISTANCE)
            weight /= weight.sum(axis=1, keepdims=True)
            out[part] = np.einsum("mk,mkc->mc", weight, self.parameters[node])
        return out


@dataclass(frozen=True)
class NodeVariation(KnownVariation):
    """of: index of a material → its nodes; materials that are not in it are even."""

    of: Mapping[int, MaterialNodes]

    def at(self, pixels: Pixels) -> VariationAtPixels:
        reflectance = np.ones((len(pixels), 3), np.float32)
        albedo, normal = np.ones_like(reflectance), np.array(pixels.normal, np.float32)
        for index, own in self.of.items():
            rows = np.flatnonzero(pixels.material == index)
            if not len(rows):
                continue
            scan = normal[rows]
            parameters = own.at(pixels.point[rows], scan)
            shading = Shading(*(getattr(pixels, n)[rows] for n in ("light", "view", "irradiance")))
            typical = np.zeros_like(parameters)
            typical[:, TILT] = parameters[:, TILT]
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = own.model.radiance(shading, scan, parameters)
                ratio /= own.model.radiance(shading, scan, typical)
            albedo[rows] = own.model.albedo_factor(parameters)
            reflectance[rows] = np.where(np.isfinite(ratio), ratio, albedo[rows])
            normal[rows] = tilted(scan, parameters)
        return VariationAtPixels(reflectance, albedo, normal)


def _places(
    points: NDArray[np.float64], normals: NDArray[np.floating], spacing: float
) -> NDArray[np.float64]:
    """(m, 6) points in spacings of the nodes, and normals so scaled that opposite sides of a wall
    are far apart."""
    return np.concatenate([points / spacing, normals / NORMAL_SCALE], axis=1)
