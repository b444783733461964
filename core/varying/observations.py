"""What each photo shows at the nodes of a surface grid: radiance, light and view."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ..samples.clipped import White
from .node_model import Shading
from .surface_grid import SurfaceGrid
from .surface_photo import MIN_COSINE, SurfacePhoto, bilinear_corners

CHUNK = 1 << 17  # nodes projected at once, to limit memory


@dataclass(frozen=True)
class Observations:
    """m observations of nodes, sorted by node.

    node: (m,) int32; photo: (m,) int16; material: (m,) uint8, index of the pixel's material;
    radiance: (m, 3) linear; light, view: (m, 3) unit, from the surface; irradiance: (m, 3) on a
    surface that faces the light. float32, scan frame. clipped: (m, 3) bool, whether the radiance
    of a channel is at least the one given, because a pixel is clipped.
    """

    node: NDArray[np.int32]
    photo: NDArray[np.int16]
    material: NDArray[np.uint8]
    radiance: NDArray[np.float32]
    light: NDArray[np.float32]
    view: NDArray[np.float32]
    irradiance: NDArray[np.float32]
    clipped: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.node)

    @property
    def shading(self) -> Shading:
        """Light and view of each."""
        return Shading(self.light, self.view, self.irradiance)

    def select(self, rows: NDArray | slice) -> Observations:
        """The observations ``rows``, an increasing subset."""
        return Observations(*(getattr(self, f.name)[rows] for f in fields(self)))

    def measured(self) -> Observations:
        """The observations without a clipped channel."""
        return self.select(np.flatnonzero(~self.clipped.any(axis=1)))

    def at_nodes(self, rows: NDArray[np.intp], count: int) -> Observations:
        """The observations of the nodes ``rows``, increasing, of ``count``, numbered from 0."""
        number = np.full(count, -1, np.int32)
        number[rows] = np.arange(len(rows), dtype=np.int32)
        own = self.select(np.flatnonzero(number[self.node] >= 0))
        return replace(own, node=number[own.node])

    @staticmethod
    def joined(parts: list[Observations]) -> Observations:
        """All observations, sorted by node; those of a node in the order of ``parts``."""
        names = [f.name for f in fields(Observations)]
        order = np.argsort(np.concatenate([p.node for p in parts]), kind="stable")
        return Observations(*(np.concatenate([getattr(p, n) for p in parts])[order] for n in names))


def observe(look: SurfacePhoto, photo: int, grid: SurfaceGrid) -> Observations:
    """The observations of all nodes that are visible, lit, and on reliable pixels of one photo,
    clipped ones included."""
    white = White.of(look.radiance, look.labels.clipped == 0).level
    parts = []
    for begin in range(0, len(grid), CHUNK):
        rows = np.arange(begin, min(begin + CHUNK, len(grid)))
        parts.append(_chunk(look, photo, white, grid.points(rows), grid.normals(rows), begin))
    return Observations.joined(parts)


def _chunk(
    look: SurfacePhoto,
    photo: int,
    white: float,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    first: int,
) -> Observations:
    rows, view, pixels = look.facing(points, normals)
    weights, corners = bilinear_corners(pixels, look.camera)
    clipped = look.labels.clipped.ravel()[corners]
    reliable = look.labels.trusted.ravel()[corners] + clipped
    good = (reliable > 0).all(axis=1) & (reliable == reliable[:, :1]).all(axis=1)
    rows, view, weights, corners, reliable, clipped = (
        a[good] for a in (rows, view, weights, corners, reliable, clipped)
    )
    light = look.light.incidence(points[rows], look.camera)
    cosine = np.einsum("ij,ij->i", normals[rows], light.towards)
    lit = (cosine > MIN_COSINE) & (light.irradiance > 1e-30).all(axis=1)
    lit &= ~look.hidden(points[rows], normals[rows], view)
    lit[lit] &= ~look.shadowed(points[rows[lit]], normals[rows[lit]], light.select(lit))
    rows, view, weights, corners = (a[lit] for a in (rows, view, weights, corners))
    light, clipped = light.select(lit), clipped[lit] > 0
    flat = look.radiance.reshape(-1, 3)
    radiance = np.einsum("nj,njc->nc", weights, flat[corners])
    bound = np.zeros(radiance.shape, bool)
    some = np.flatnonzero(clipped.any(axis=1))
    bound[some] = ((flat[corners[some]] >= white) & clipped[some, :, None]).any(axis=1)
    n = len(rows)
    return Observations(
        node=(rows + first).astype(np.int32),
        photo=np.full(n, photo, np.int16),
        material=(reliable[lit, 0] - 1).astype(np.uint8),
        radiance=radiance.astype(np.float32),
        light=np.broadcast_to(light.towards, (n, 3)).astype(np.float32),
        view=np.asarray(view, np.float32),
        irradiance=np.broadcast_to(light.irradiance, (n, 3)).astype(np.float32),
        clipped=bound,
    )
