"""Random pixels of the lit photos for calibration: gently curved surface, radiance averaged over a
small box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene
from ..geometry.pixel_hits import pixel_hits
from ..geometry.rays import Hits
from ..scan import Camera

Array = NDArray[np.float64]

REACH = 3  # pixels to the neighbours that must show the same surface
MIN_NORMAL_COSINE = np.cos(np.radians(12.0))  # between their normals
BOX = 2  # radiance is the mean of (2 BOX + 1)² pixels, which reduces texture and noise
DARK = 0.003  # of the 95th percentile: below it noise and stray light dominate


@dataclass(frozen=True)
class CalibrationPixels:
    """n pixels of one photo. point, normal, view: (n, 3) float64, scan frame, view surface →
    camera; radiance: (n,) mean of the channels; weight: (n,) of each; material: (n,) index of its
    material."""

    camera: Camera
    point: Array
    normal: Array
    view: Array
    radiance: Array
    weight: Array
    material: NDArray[np.int16]

    def select(self, which: NDArray) -> CalibrationPixels:
        """The rows of a boolean mask or an index array."""
        return CalibrationPixels(
            self.camera, self.point[which], self.normal[which], self.view[which],
            self.radiance[which], self.weight[which], self.material[which],
        )  # fmt: skip


def draw_pixels(
    rays: RayScene,
    camera: Camera,
    radiance: NDArray[np.float32],
    material: NDArray[np.int16],
    count: int,
    rng: np.random.Generator,
) -> CalibrationPixels:
    """Up to ``count`` random pixels of a photo. radiance: (h, w, 3); material: (h, w) index of each
    pixel's material, −1 for pixels that must not be used."""
    edge = REACH + BOX
    inside = max(camera.height - 2 * edge, 0), max(camera.width - 2 * edge, 0)
    pixels = inside[0] * inside[1]
    # most of a photo may be background
    where = rng.choice(max(pixels, 1), min(pixels, 40 * count), replace=False)
    row, column = np.divmod(where, max(inside[1], 1))
    row, column = row + edge, column + edge
    found = [_calm(rays, camera, radiance, material, row[:0], column[:0])]
    drawn = 0
    for begin in range(0, len(where), 8 * count):
        part = slice(begin, begin + 8 * count)
        found.append(_calm(rays, camera, radiance, material, row[part], column[part]))
        drawn += len(found[-1].radiance)
        if drawn >= count:
            break
    return CalibrationPixels(
        camera=camera,
        point=np.concatenate([s.point for s in found])[:count],
        normal=np.concatenate([s.normal for s in found])[:count],
        view=np.concatenate([s.view for s in found])[:count],
        radiance=np.concatenate([s.radiance for s in found])[:count],
        weight=np.concatenate([s.weight for s in found])[:count],
        material=np.concatenate([s.material for s in found])[:count],
    )


def _calm(
    rays: RayScene,
    camera: Camera,
    radiance: NDArray[np.float32],
    material: NDArray[np.int16],
    row: NDArray[np.intp],
    column: NDArray[np.intp],
) -> CalibrationPixels:
    """Those of the pixels whose neighbours show the same, gently curved surface."""
    keep = np.ones(len(row), bool)
    face, u, v = np.full(len(row), -1, np.int32), np.zeros(len(row)), np.zeros(len(row))
    centre = np.zeros((len(row), 3))
    towards = np.zeros((len(row), 3))
    for k, (down, right) in enumerate(((0, 0), (REACH, 0), (-REACH, 0), (0, REACH), (0, -REACH))):
        some = np.flatnonzero(keep)
        pixels = np.stack([column[some] + right + 0.5, row[some] + down + 0.5], axis=1)
        hit, met, view = pixel_hits(rays, camera, pixels)
        keep[some[~hit]] = False
        normal = rays.normals(met)
        if k == 0:
            centre[some[hit]], towards[some[hit]] = normal, view
            face[some[hit]], u[some[hit]], v[some[hit]] = met.face, met.u, met.v
        else:
            same = np.einsum("ij,ij->i", normal, centre[some[hit]]) > MIN_NORMAL_COSINE
            keep[some[hit][~same]] = False
    window = range(-BOX, BOX + 1)
    light, whole = np.zeros(len(row)), material[row, column] >= 0
    for down in window:
        for right in window:
            light += radiance[row + down, column + right].mean(axis=1)
            whole &= material[row + down, column + right] == material[row, column]
    keep &= whole & (light > 0)
    hits = Hits(face[keep], u[keep].astype(np.float32), v[keep].astype(np.float32))
    mean = light[keep] / len(window) ** 2
    return CalibrationPixels(
        camera, rays.points(hits), centre[keep], towards[keep], mean, np.ones(len(mean)),
        material[row, column][keep],
    )  # fmt: skip


def not_dark(seen: list[CalibrationPixels]) -> list[CalibrationPixels]:
    """Without pixels that are nearly black relative to all photos together."""
    together = np.concatenate([s.radiance for s in seen])
    bright = float(np.percentile(together, 95)) if together.size else 0.0
    return [s.select(s.radiance > DARK * bright) for s in seen]
