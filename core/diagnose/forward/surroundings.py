"""The surroundings of every pixel's surface point: open directions, or the object's own surface.

Half of the directions are drawn by the cosine over the hemisphere, half from a lobe of medium width
about the mirrored view. They are weighted by the balance heuristic (Veach and Guibas 1995), so that
diffuse and glossy parts of a BRDF are both integrated well.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...angles import half_difference
from ...angles.vectors import tangents
from ...geometry import RayScene
from ...geometry.lift import SHADOW_LIFT
from .material_brdfs import MaterialBRDFs
from .pixels import Pixels
from .radiosity import OPEN, front_faces

Array = NDArray[np.floating]

ALPHA = 0.15  # roughness of the lobe from which the second half is drawn
ACCURACY = 0.02  # relative error of such sums
CHUNK = 2048  # pixels at a time


@dataclass(frozen=True)
class Surroundings:
    """towards: (n, d, 3) unit, float32. share: (n, d) weight of each direction in an integral
    over the hemisphere, cosθ/density, 0 below the horizon. face: (n, d) int32 of the mesh that is
    seen there, OPEN or BEHIND (radiosity.py). reflected: (n, d, 3) ρ·share."""

    towards: NDArray[np.float32]
    share: NDArray[np.float32]
    face: NDArray[np.int32]
    reflected: NDArray[np.float32]

    @classmethod
    def of(
        cls, pixels: Pixels, brdfs: MaterialBRDFs, rays: RayScene, ray_count: int
    ) -> Surroundings:
        """Of all pixels of a diagnosis. brdfs: before any effect; ray_count: half of d."""
        parts = [
            _part(pixels.select(rows), brdfs, rays, ray_count, seed)
            for seed, rows in enumerate(_chunks(len(pixels)))
        ]
        return cls(*(np.concatenate([p[k] for p in parts]) for k in range(4)))

    @property
    def open(self) -> NDArray[np.bool_]:
        """(n, d) whether the object does not block the direction."""
        return self.face == OPEN

    def reflected_light(self, radiance: Array) -> Array:
        """(n, 3) reflected radiance of incident radiance (n, d) or (n, d, 3) from each
        direction."""
        if radiance.ndim == 2:
            return np.einsum("ndc,nd->nc", self.reflected, radiance)
        return np.einsum("ndc,ndc->nc", self.reflected, radiance)


def _chunks(n: int) -> Iterator[slice]:
    for start in range(0, n, CHUNK):
        yield slice(start, min(start + CHUNK, n))


def _part(
    pixels: Pixels, brdfs: MaterialBRDFs, rays: RayScene, each: int, seed: int
) -> tuple[NDArray, ...]:
    rng = np.random.default_rng(seed)
    n, d = len(pixels), 2 * each
    normal, view = pixels.normal.astype(np.float64), pixels.view.astype(np.float64)
    frame = np.stack([*tangents(normal), normal], axis=1)  # (n, 3, 3), rows
    u = (np.arange(each) + rng.random((n, each))) / each
    turn = 2 * np.pi * (0.61803399 * np.arange(each) + rng.random((n, 1)))
    sine = np.sqrt(u)
    matte = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - u)], axis=-1)
    tangent2 = ALPHA**2 * u / np.maximum(1 - u, 1e-6)
    cos_h = 1 / np.sqrt(1 + tangent2)
    sin_h = np.sqrt(np.maximum(1 - cos_h**2, 0))
    half = np.stack([sin_h * np.cos(turn), sin_h * np.sin(turn), cos_h], axis=-1)
    local_view = np.einsum("nij,nj->ni", frame, view)
    glossy = 2 * np.einsum("ndi,ni->nd", half, local_view)[..., None] * half - local_view[:, None]
    local = np.concatenate([matte, glossy], axis=1)
    cosine = local[..., 2]
    middle = local + local_view[:, None]
    middle /= np.maximum(np.linalg.norm(middle, axis=2, keepdims=True), 1e-9)
    cos_m = np.clip(middle[..., 2], 1e-4, 1)
    cos_d = np.maximum(np.einsum("ndi,ni->nd", middle, local_view), 1e-4)
    lobe = ALPHA**2 / (np.pi * (cos_m**2 * (ALPHA**2 - 1) + 1) ** 2)
    density = 0.5 * np.maximum(cosine, 0) / np.pi + 0.5 * lobe * cos_m / (4 * cos_d)
    share = np.where(cosine > 1e-3, cosine / np.maximum(density, 1e-9), 0.0) / d
    towards = np.einsum("ndi,nij->ndj", local, frame).astype(np.float32).reshape(-1, 3)
    lift = SHADOW_LIFT * rays.mesh.size
    start = np.repeat(pixels.point + lift * normal, d, axis=0)
    hit = rays.first_hits(start, towards).face
    face = front_faces(rays.mesh, hit, towards).astype(np.int32).reshape(n, d)
    wide = [np.repeat(v, d, axis=0) for v in (pixels.normal, pixels.view)]
    angles = half_difference(wide[0], towards, wide[1])
    rho = brdfs.evaluate(angles, np.repeat(pixels.material, d)).reshape(n, d, 3)
    share = share.astype(np.float32)
    return towards.reshape(n, d, 3), share, face, (rho * share[..., None]).astype(np.float32)
