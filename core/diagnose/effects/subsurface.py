"""Subsurface scattering: light enters the surface and leaves it elsewhere, at shadow edges too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ...geometry.view import cast_shadow
from ..forward.diagnosis_context import DiagnosisContext
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState
from .base.effect import Array
from .base.image_formation import AddsRadiance
from .base.parameters import Parameters

RADII = (0.015, 0.04, 0.1)  # scattering distances, fractions of the object's size
CUT = 2.5  # radii beyond which the kernel is cut off
NEIGHBOURS = 100  # points within that distance of a pixel, about
MAX_POINTS = 20_000  # on the surface
MIN_FRACTION = 0.03
"""Of the light. Marble and wax scatter most of it; less than this at the edges of shadows is light
from the room or an edge of the mesh that is not in its place."""
MAX_NEIGHBOURS = 160  # points that are looked up for a pixel at most


@dataclass(frozen=True)
class Subsurface(AddsRadiance):
    """Parameters: the fraction of the light that scatters over each of RADII, for red, green and
    blue. spread: (r, n, 3) radiance that a white surface gains or loses where that fraction is 1.
    size: of the object, scan units."""

    spread: Array
    size: float
    cause = "subsurface"
    deciding_photo = "one close photo of the edge of a sharp shadow"

    @classmethod
    def of(cls, context: DiagnosisContext) -> Subsurface:
        pixels, mesh = context.pixels, context.rays.mesh
        spread = np.zeros((len(RADII), len(pixels), 3), np.float32)
        cosine = np.maximum(np.einsum("ij,ij->i", pixels.normal, pixels.light), 0)
        own = pixels.irradiance * (cosine * pixels.visible)[:, None]
        corners = mesh.vertices[mesh.faces]
        edges = corners[:, 1:] - corners[:, :1]
        areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
        area = float(areas.sum()) / context.size**2
        for k, radius in enumerate(RADII):
            count = int(min(MAX_POINTS, NEIGHBOURS * area / (np.pi * (CUT * radius) ** 2)))
            points, faces = _spread(corners, areas, max(count, 200), seed=k)
            normals = mesh.face_normals[faces].astype(np.float32)
            mixing = _mixing(pixels.point, points, radius * context.size)
            for photo in np.unique(pixels.photo):
                rows = np.flatnonzero(pixels.photo == photo)
                towards = np.broadcast_to(pixels.light[rows[0]], points.shape)
                received = np.maximum(normals @ pixels.light[rows[0]], 0)
                received *= ~cast_shadow(context.rays, points, normals, towards, None)
                blurred = (mixing[rows] @ received)[:, None] * pixels.irradiance[rows]
                spread[k, rows] = (blurred - own[rows]) / np.pi
        return cls(spread, context.size)

    @property
    def parameters(self) -> Parameters:
        names = [f"{100 * r:.1f} % of the size, {c}" for r in RADII for c in "rgb"]
        return Parameters.alike(names, "of the light", 0.15, 0.0, 1.0)

    def is_relevant(self, x: np.ndarray) -> bool:
        return float(x.reshape(-1, 3).sum(axis=0).max()) > MIN_FRACTION

    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: np.ndarray) -> Array:
        return np.einsum("knc,kc->nc", self.spread, x.reshape(-1, 3).astype(np.float32))

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        part = x.reshape(-1, 3).mean(axis=1)
        far = float(np.sum(part * np.array(RADII)) / max(float(part.sum()), 1e-9))
        return (
            "The material scatters light below its surface (marble, wax, skin): about "
            f"{100 * part.sum():.0f} % of the light spreads over {far * self.size:.2g} scan "
            "units, so light leaks across the edges of shadows."
        )


def _spread(corners: Array, areas: Array, count: int, seed: int) -> tuple[Array, Array]:
    """(points (count, 3), their faces) uniformly distributed on triangles (f, 3, 3)."""
    rng = np.random.default_rng(seed)
    steps = np.cumsum(areas)
    evenly = (np.arange(count) + rng.random(count)) / count * steps[-1]
    face = np.minimum(np.searchsorted(steps, evenly), len(areas) - 1)
    root, v = np.sqrt(rng.random(count)), rng.random(count)
    weight = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    return np.einsum("pk,pkx->px", weight, corners[face]), face


def _mixing(pixels: Array, points: Array, radius: float) -> csr_array:
    """(n, m) weights exp(−distance / radius) of the points near each pixel; rows sum to 1."""
    near, which = cKDTree(points).query(
        pixels, min(MAX_NEIGHBOURS, len(points)), distance_upper_bound=CUT * radius
    )
    weight = np.where(np.isfinite(near), np.exp(-np.minimum(near / radius, 50)), 0.0)
    weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-30)
    n, k = near.shape
    where = np.where(np.isfinite(near), which, 0).ravel()
    return csr_array((weight.ravel(), where, k * np.arange(n + 1)), shape=(n, len(points)))
