"""Random pixels of a lit photo for the search of its light, lit ones and dark ones alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene
from ..geometry.pixel_hits import pixel_hits
from ..scan import Camera

Array = NDArray[np.float64]

MIN_VIEW_COSINE = 0.3  # beside outlines a small error of the pose shows another surface
MAX_TRIES = 60  # pixels drawn per pixel wanted: most of a photo may be background


@dataclass(frozen=True)
class LampPhoto:
    """n pixels of one photo. point, normal, view: (n, 3) float64, scan frame, view surface →
    camera; radiance: (n,) mean of the channels, not negative; material: (n,) index of its
    material."""

    camera: Camera
    point: Array
    normal: Array
    view: Array
    radiance: Array
    material: NDArray[np.int16]

    def first(self, count: int) -> LampPhoto:
        """The first ``count`` pixels, a random choice because all are."""
        return self.select(slice(count))

    def select(self, which: NDArray | slice) -> LampPhoto:
        """The pixels of a boolean mask, an index array or a slice."""
        return LampPhoto(
            self.camera, self.point[which], self.normal[which], self.view[which],
            self.radiance[which], self.material[which],
        )  # fmt: skip


def draw_lamp_pixels(
    rays: RayScene,
    camera: Camera,
    radiance: NDArray[np.float32],
    material: NDArray[np.int16],
    count: int,
    rng: np.random.Generator,
) -> LampPhoto:
    """Up to ``count`` random pixels that show the mesh. radiance: (h, w, 3); material: (h, w) index
    of each pixel's material, −1 for pixels that must not be used."""
    total = camera.height * camera.width
    order = rng.choice(total, min(total, MAX_TRIES * count), replace=False)
    order = order[material.ravel()[order] >= 0]
    parts: list[tuple[Array, Array, Array, NDArray[np.intp]]] = []
    drawn = 0
    for start in range(0, len(order), 4 * count):
        pixel = order[start : start + 4 * count]
        parts.append(_surface(rays, camera, pixel))
        drawn += len(parts[-1][3])
        if drawn >= count:
            break
    none = np.zeros((0, 3))
    point, normal, view = (
        np.concatenate([none, *(part[k] for part in parts)])[:count] for k in range(3)
    )
    pixel = np.concatenate([np.zeros(0, np.intp), *(part[3] for part in parts)])[:count]
    level = radiance.reshape(-1, 3)[pixel].astype(np.float64).mean(axis=1)
    return LampPhoto(
        camera, point, normal, view, np.maximum(level, 0.0), material.ravel()[pixel]
    )  # fmt: skip


def _surface(
    rays: RayScene, camera: Camera, pixel: NDArray[np.intp]
) -> tuple[Array, Array, Array, NDArray[np.intp]]:
    """(points, normals, views (n, 3), flat pixel indices (n,)) of the pixels that show the mesh not
    at grazing view."""
    row, column = np.divmod(pixel, camera.width)
    centres = np.stack([column + 0.5, row + 0.5], axis=1)
    hit, found, view = pixel_hits(rays, camera, centres)
    normal = rays.normals(found)
    facing = np.einsum("ij,ij->i", normal, view) > MIN_VIEW_COSINE
    return rays.points(found)[facing], normal[facing], view[facing], pixel[hit][facing]
