"""The part of the scanned surface that one camera sees."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from . import edges
from .curvature import slope_curvature
from .pixel_rays import PixelRays
from .rays import Hits, RayScene
from .window import Window, bands

COLUMNS: dict[str, NDArray] = {
    "pixel": np.zeros(0, np.int32),
    "face": np.zeros(0, np.int32),
    "point": np.zeros((0, 3)),
    "normal": np.zeros((0, 3), np.float32),
    "view": np.zeros((0, 3), np.float32),
    "curvature": np.zeros(0, np.float32),
}  # the arrays of a view with no pixels


@dataclass(frozen=True)
class SurfaceView:
    """The surface behind every pixel of a photo, or of a window of it, that hits it; n pixels in
    row-major order.

    shape: (h, w) of the window; seen: (h, w) whether a pixel hits; pixel: (n,) int32 flat indices
    in the whole photo; face: (n,) int32; point: (n, 3) float64, scan units; normal: (n, 3) unit,
    smooth; view: (n, 3) unit, surface → camera, both float32; curvature: (n,) float32, 1/pixel, NaN
    at outlines; silhouette: (h, w) outline pixels. Frame: the scan's. place: (n,) int32 flat
    indices in the window, None where it is the whole photo. wanted: the rows of the n pixels
    outside the window's halo.
    """

    shape: tuple[int, int]
    seen: NDArray[np.bool_]
    pixel: NDArray[np.int32]
    face: NDArray[np.int32]
    point: NDArray[np.float64]
    normal: NDArray[np.floating]
    view: NDArray[np.floating]
    curvature: NDArray[np.float32]
    silhouette: NDArray[np.bool_]
    place: NDArray[np.int32] | None = None
    wanted: slice = field(default_factory=lambda: slice(None))

    def image(self, values: NDArray, fill: float = np.nan) -> NDArray:
        """(h, w) or (h, w, c) image of values (n,) or (n, c) at their pixels."""
        out = np.full((self.shape[0] * self.shape[1], *values.shape[1:]), fill, values.dtype)
        out[self.pixel if self.place is None else self.place] = values
        return out.reshape(*self.shape, *values.shape[1:])

    def at(self, image: NDArray) -> NDArray:
        """(n,) or (n, c) values of an image (h, w) or (h, w, c) of the window at the pixels."""
        flat = image.reshape(self.shape[0] * self.shape[1], *image.shape[2:])
        return flat.take(self.pixel if self.place is None else self.place, axis=0)


def view_surface(rays: RayScene, camera: Camera) -> SurfaceView:
    """The view of a whole photo, with one ray through the centre of every pixel."""
    lines = PixelRays.of(camera)
    windows = list(bands(camera, halo=1, columns=rays.cover.columns(camera)))
    return _joined(camera, windows, (view_window(rays, lines, window) for window in windows))


def view_window(rays: RayScene, lines: PixelRays, window: Window) -> SurfaceView:
    """The view of a window of a photo. Outlines and curvature equal those of the whole photo except
    in the rows at the window's ends."""
    camera, shape = lines.camera, window.shape
    directions = lines.window(window.top, window.bottom, window.left, window.right)
    blind = ~np.isfinite(directions).all(axis=0)  # pixels without a ray, for example in the corners
    if blind.any():
        directions[:, blind] = -camera.pose.rotation[2][:, None]
    start = camera.pose.centre
    if camera.orthographic:  # its rays start in front of the whole object
        rows, columns = np.mgrid[window.top : window.bottom, window.left : window.right]
        pixels = np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=1)
        start = rays.just_before(camera.ray_starts(pixels), directions.T.astype(np.float64))
    hits = rays.first_hits(start, directions.T)
    assert hits.distance is not None
    hit = (hits.face >= 0) & ~blind
    place = np.flatnonzero(hit).astype(np.int32)
    found = Hits(hits.face.take(place), hits.u.take(place), hits.v.take(place))
    local, normal = rays.surface(found)
    point = local.astype(np.float64)
    point += rays.origin[:, None]
    view = directions.take(place, axis=1)
    np.negative(view, out=view)
    depth = np.where(hit, hits.distance, np.float32(np.nan)).reshape(shape)
    row, column = np.divmod(place, np.int32(shape[1]))
    pixel = (row + np.int32(window.top)) * np.int32(camera.width)
    pixel += column + np.int32(window.left)
    wanted = np.searchsorted(row, [window.first - window.top, window.last - window.top])
    return SurfaceView(
        shape=shape,
        seen=hit.reshape(shape),
        pixel=pixel,
        face=found.face,
        point=point.T,
        normal=normal.T,
        view=view.T,
        curvature=_curvature(camera, normal, place, shape),
        silhouette=edges.silhouette(depth, camera.footprint(depth)),
        place=place,
        wanted=slice(int(wanted[0]), int(wanted[1])),
    )


def _curvature(
    camera: Camera, normal: NDArray[np.float32], place: NDArray[np.int32], shape: tuple[int, int]
) -> NDArray[np.float32]:
    """(n,) screen-space mean curvature at the pixels ``place``, from normals (3, n) in the scan
    frame.

    Rotates the normals to the camera frame and computes the gradient of Ono et al. 2019, equation
    (5); slope_curvature computes equations (6) and (7).
    """
    x, y, z = normal
    rotation = camera.pose.rotation.astype(np.float32)
    facing = -(rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z)
    facing = np.where(facing > 1e-3, facing, np.float32(np.nan))
    slopes = np.full((2, shape[0] * shape[1]), np.nan, np.float32)
    for axis in range(2):
        slope = rotation[axis, 0] * x + rotation[axis, 1] * y + rotation[axis, 2] * z
        slopes[axis, place] = -slope / facing
    return slope_curvature(*slopes.reshape(2, *shape)).ravel().take(place)


def _joined(camera: Camera, windows: Sequence[Window], parts: Iterable[SurfaceView]) -> SurfaceView:
    """One view of a whole photo, from the wanted rows of its bands."""
    shape = camera.height, camera.width
    silhouette, seen = np.zeros(shape, bool), np.zeros(shape, bool)
    lists: dict[str, list[NDArray]] = {name: [] for name in COLUMNS}
    for part, window in zip(parts, windows, strict=True):
        rows = slice(window.first - window.top, window.last - window.top)
        target = slice(window.first, window.last), slice(window.left, window.right)
        silhouette[target] = part.silhouette[rows]
        seen[target] = part.seen[rows]
        for name, values in lists.items():
            values.append(np.ascontiguousarray(getattr(part, name)[part.wanted]))
    joined = {}
    for name, none in COLUMNS.items():
        joined[name] = np.concatenate([none, *lists.pop(name)])
    return SurfaceView(shape=shape, seen=seen, silhouette=silhouette, **joined)


def cast_shadow(
    rays: RayScene,
    points: NDArray[np.float64],
    normals: NDArray[np.floating],
    towards: NDArray[np.floating],
    distance: NDArray[np.floating] | None,
) -> NDArray[np.bool_]:
    """(n,) whether the mesh blocks the light along ``towards`` (n, 3) at ``points`` (n, 3) with
    ``normals`` (n, 3), up to ``distance`` (n,) where the light is near."""
    lift = np.float32(rays.lift)
    return rays.occluded(points, towards, distance, lift * normals.astype(np.float32, copy=False))
