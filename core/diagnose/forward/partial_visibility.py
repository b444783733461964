"""How much of the lamp's light the mesh lets through to a pixel: from rays through parts of it.

One ray from its middle says all or nothing. What it then errs by is no noise: of the pixels that
are called lit those beside the edge of a shadow are darker, all of them. Where light grazes the
object nearly every lit pixel is beside one, and the photo would seem darker than it is.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...geometry import RayScene
from ...geometry.view import cast_shadow
from .pixels import Pixels

Array = NDArray[np.floating]

SIDE = 4  # rays a side of a pixel
RAYS = SIDE**2
REACH = 2.0  # steps from a pixel to the next that its surface may lie before or behind its plane


def pixel_part_points(rays: RayScene, pixels: Pixels) -> NDArray[np.float64]:
    """(RAYS, n, 3) points of the mesh that each pixel shows. Its plane at the pixel's middle is no
    surface: in a hollow it lies under the mesh, in the dark."""
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
    """(n,) part of the irradiance of a pixel's surface that arrives; 1 where it is turned away.
    towards: (n, 3) unit, to the lamp, or for each of RAYS rays to another part of it; distance:
    (n,) to it, None: it is far. parts: ``parts_of`` the pixels, where they are known."""
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
    """Pixels right of and below its middle."""
    down, right = ((k + 0.5) / SIDE - 0.5 for k in divmod(ray, SIDE))
    return right, down
