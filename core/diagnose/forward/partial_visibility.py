"""Partial visibility: the fraction of the lamp's light that reaches a pixel, from several rays.

A single ray from the centre gives 0 or 1, and its error is not noise: of the pixels that it counts
as lit, all near the edge of a shadow are darker. Under grazing light nearly every lit pixel is near
an edge, and the photo would seem too dark.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...geometry import RayScene
from ...geometry.view import cast_shadow
from .pixels import Pixels

Array = NDArray[np.floating]

SIDE = 4  # rays along each side of a pixel
RAYS = SIDE**2
REACH = 2.0  # pixel spacings that the surface may lie in front of or behind the pixel's plane


def pixel_part_points(rays: RayScene, pixels: Pixels) -> NDArray[np.float64]:
    """(RAYS, n, 3) points of the mesh that each pixel shows. Points on the tangent plane would not
    do: in a hollow it lies below the mesh, in the dark."""
    reach = REACH * np.linalg.norm(pixels.step, axis=2).max(axis=1, keepdims=True)
    found = np.empty((RAYS, len(pixels), 3))
    for ray in range(RAYS):
        right, down = _aside(ray)
        plane = pixels.point + right * pixels.step[:, 0] + down * pixels.step[:, 1]
        hits = rays.first_hits(plane + reach * pixels.view, -pixels.view)
        assert hits.distance is not None
        before = reach - np.where(hits.face >= 0, hits.distance, np.inf)[:, None]  # of the plane
        found[ray] = plane + np.where(np.abs(before) < reach, before, 0.0) * pixels.view
    return found


def partial_visibility(
    rays: RayScene,
    pixels: Pixels,
    towards: Array | Callable[[int], Array],
    distance: Array | None = None,
    parts: NDArray[np.float64] | None = None,
) -> NDArray[np.float32]:
    """(n,) fraction of the irradiance on a pixel's surface that arrives; 1 where it is turned away.
    towards: (n, 3) unit, to the lamp, or a function that gives it for each of RAYS rays. distance:
    (n,) of the lamp, scan units; None: distant. parts: ``pixel_part_points``, if known already."""
    parts = pixel_part_points(rays, pixels) if parts is None else parts
    full, through = np.zeros((2, len(pixels)))
    for ray in range(RAYS):
        right, down = _aside(ray)
        lamp = towards(ray) if callable(towards) else towards
        normal = pixels.normal + np.float32(right) * pixels.turn[:, 0]
        normal = normal + np.float32(down) * pixels.turn[:, 1]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        cos_i = np.maximum(np.einsum("ni,ni->n", normal, lamp), 0)
        facing = np.flatnonzero(cos_i > 0)
        far = None if distance is None else distance[facing]
        hidden = cast_shadow(rays, parts[ray, facing], normal[facing], lamp[facing], far)
        full += cos_i
        through[facing[~hidden]] += cos_i[facing[~hidden]]
    return np.where(full > 0, through / np.maximum(full, 1e-12), 1.0).astype(np.float32)


def _aside(ray: int) -> tuple[float, float]:
    """(right, down) offset of a ray from the centre of a pixel, pixels."""
    down, right = ((k + 0.5) / SIDE - 0.5 for k in divmod(ray, SIDE))
    return right, down
