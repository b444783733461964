"""What one camera sees of the scanned surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from . import edges
from .curvature import mean_curvature
from .rays import Hits, RayScene

# Shadow rays start this fraction of the object's size above the surface: a scanned surface is rough
# at the scale of its triangles and would shadow itself
SHADOW_LIFT = 5e-4


@dataclass(frozen=True)
class SurfaceView:
    """The surface behind every pixel of one photo that hits it; n pixels in row-major order.

    seen: (h, w) which pixels hit; pixel: (n,) int32 flat indices; face: (n,) int32;
    point: (n, 3) float64; normal: (n, 3) unit, smooth; view: (n, 3) unit, surface → camera;
    curvature: (n,) float32, 1/pixel, NaN at outlines; silhouette: (h, w) outline pixels.
    Frame: the scan's.
    """

    shape: tuple[int, int]
    seen: NDArray[np.bool_]
    pixel: NDArray[np.int32]
    face: NDArray[np.int32]
    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    view: NDArray[np.float64]
    curvature: NDArray[np.float32]
    silhouette: NDArray[np.bool_]

    def image(self, values: NDArray, fill: float = np.nan) -> NDArray:
        """Values (n,) or (n, c) put back at their pixels: (h, w) or (h, w, c)."""
        out = np.full((self.shape[0] * self.shape[1], *values.shape[1:]), fill, values.dtype)
        out[self.pixel] = values
        return out.reshape(*self.shape, *values.shape[1:])


def view_surface(rays: RayScene, camera: Camera) -> SurfaceView:
    """Cast one ray through every pixel's centre."""
    shape = (camera.height, camera.width)
    rows, columns = np.indices(shape, np.float64)
    pixels = np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=1)
    directions = camera.rays(pixels)
    start = camera.ray_starts(pixels)
    if camera.orthographic:  # its rays come from behind all of the object
        start = rays.just_before(start, directions)
    blind = ~np.isfinite(directions).all(axis=1)  # corners that the lens does not reach
    directions[blind] = -directions[~blind][0] if (~blind).any() else 1.0
    hits = rays.first_hits(start, directions)
    pixel = np.flatnonzero((hits.face >= 0) & ~blind).astype(np.int32)
    found = Hits(hits.face[pixel], hits.u[pixel], hits.v[pixel])
    point, normal = rays.points(found), rays.normals(found)
    view = -directions[pixel]

    depth = np.full(shape[0] * shape[1], np.nan, np.float32)
    from_start = (start if start.ndim == 1 else start[pixel]) - point
    depth[pixel] = np.einsum("ij,ij->i", from_start, view)
    depth = depth.reshape(shape)
    in_camera = np.full((shape[0] * shape[1], 3), np.nan, np.float32)
    in_camera[pixel] = (normal @ camera.pose.rotation.T) * (1.0, 1.0, -1.0)
    curvature = mean_curvature(in_camera.reshape(*shape, 3)).ravel()[pixel]
    return SurfaceView(
        shape=shape,
        seen=np.isfinite(depth),
        pixel=pixel,
        face=found.face,
        point=point,
        normal=normal,
        view=view,
        curvature=curvature,
        silhouette=edges.silhouette(depth, camera.footprint(depth)),
    )


def cast_shadow(
    rays: RayScene,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    towards: NDArray[np.float64],
    distance: NDArray[np.float64] | None,
) -> NDArray[np.bool_]:
    """(n,) whether the mesh blocks the light along ``towards`` (n, 3) at ``points`` (n, 3) with
    ``normals`` (n, 3), up to ``distance`` (n,) where the light is near."""
    lift = SHADOW_LIFT * rays.mesh.size
    return rays.occluded(points + lift * normals, towards, distance)
