"""A sphere under the HDR worlds that Blender ships, to measure the error of a fit in pictures.

Orthographic view, no shadows or interreflection (a sphere has none). Each pixel sums ρ·L·cos over
the cells of the world (a latitude-longitude map averaged to 48 × 96 cells), with one jittered
direction per cell, equal for truth and fit. The 95th percentile of the true picture is white. PSNR
and FLIP of the 8-bit sRGB values of the disc's pixels (the background would improve them without
reason).
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from patina.core.angles import Angles, half_difference
from patina.core.predict.flip import flip_error
from patina.core.views.display import srgb

Evaluate = Callable[[Angles], NDArray[np.floating]]

ROWS, COLUMNS = 48, 96
DISC = 28  # pixels across
WHITE = 95.0  # percentile
CHUNK = 1 << 19


@dataclass(frozen=True)
class Quadrature:
    """Pairs of a pixel of the disc and a cell of the world above its horizon. pixel, cell: (m,)
    indices; angles: (m,); weight: (m,) cos θi × solid angle; pixels: number of pixels."""

    pixel: NDArray[np.int32]
    cell: NDArray[np.int32]
    angles: Angles
    weight: NDArray[np.float32]
    pixels: int


def worlds() -> dict[str, Path]:
    """Return name → .exr file of the worlds in Blender's bpy module."""
    found = importlib.util.find_spec("bpy")
    if found is None or found.origin is None:
        return {}
    root = Path(found.origin).parent
    files = sorted(root.glob("**/datafiles/studiolights/world/*.exr"))
    return {file.stem: file for file in files}


@lru_cache(maxsize=1)
def skies() -> tuple[tuple[str, ...], NDArray[np.float32]]:
    """Return (names, (worlds, ROWS·COLUMNS, 3) mean radiance of each cell)."""
    names, maps = [], []
    for name, file in worlds().items():
        pixels = np.asarray(oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT), np.float64)[..., :3]
        h, w = pixels.shape[0] // ROWS * ROWS, pixels.shape[1] // COLUMNS * COLUMNS
        theta = (np.arange(h) + 0.5) / pixels.shape[0] * np.pi
        area = np.sin(theta)[:, None, None]
        shape = (ROWS, h // ROWS, COLUMNS, w // COLUMNS, -1)
        total = (pixels[:h, :w] * area).reshape(shape).sum(axis=(1, 3))
        weight = np.broadcast_to(area, (h, w, 1)).reshape(shape).sum(axis=(1, 3))
        names.append(name)
        maps.append((total / weight).reshape(-1, 3))
    return tuple(names), np.asarray(maps, np.float32)


@lru_cache(maxsize=1)
def quadrature() -> Quadrature:
    """Return all pairs of pixel and cell."""
    axis = (np.arange(DISC) + 0.5) / DISC * 2 - 1
    x, z = np.meshgrid(axis, -axis)
    inside = _disc()
    x, z = x[inside], z[inside]
    normal = np.stack([x, -np.sqrt(1 - x**2 - z**2), z], axis=1)  # the camera looks along +y
    rng = np.random.default_rng(0)
    n, m = len(normal), ROWS * COLUMNS
    row, column = np.divmod(np.arange(m), COLUMNS)
    low, high = np.cos(np.pi * row / ROWS), np.cos(np.pi * (row + 1) / ROWS)
    cosine = low + (high - low) * rng.random((n, m))
    around = 2 * np.pi * (column + rng.random((n, m))) / COLUMNS
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    light = np.stack([sine * np.cos(around), sine * np.sin(around), cosine], axis=-1)
    cos_i = np.einsum("nmi,ni->nm", light, normal)
    pixel, cell = np.nonzero(cos_i > 1e-3)
    view = np.broadcast_to(np.array([0.0, -1.0, 0.0]), (len(pixel), 3))
    angles = half_difference(normal[pixel], light[pixel, cell], view)
    solid = (2 * np.pi / COLUMNS) * (low - high)
    weight = cos_i[pixel, cell] * solid[cell]
    return Quadrature(
        pixel.astype(np.int32),
        cell.astype(np.int32),
        Angles(*(a.astype(np.float32) for a in angles)),
        weight.astype(np.float32),
        n,
    )


def pictures(evaluate: Evaluate) -> NDArray[np.float32]:
    """Return the radiance (worlds, pixels, 3) of the disc's pixels under every world."""
    q, (_, sky) = quadrature(), skies()
    out = np.zeros((len(sky), q.pixels, 3))
    for start in range(0, len(q.pixel), CHUNK):
        part = slice(start, start + CHUNK)
        rho = np.asarray(evaluate(Angles(*(a[part] for a in q.angles))), np.float32)
        weighted = rho * q.weight[part, None]
        for w in range(len(sky)):
            light = weighted * sky[w, q.cell[part]]
            for c in range(3):
                out[w, :, c] += np.bincount(q.pixel[part], light[:, c], q.pixels)
    return out.astype(np.float32)


def psnr(fit: NDArray[np.float32], truth: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the PSNR (worlds,) in dB of pictures of :func:`pictures`, at most 60 (equal bytes)."""
    found = []
    for a, b in _displayed(fit, truth):
        mse = float(np.mean((a.astype(float) - b) ** 2))
        found.append(10 * np.log10(255.0**2 / max(mse, 255.0**2 * 1e-6)))
    return np.array(found)


def flip(fit: NDArray[np.float32], truth: NDArray[np.float32]) -> NDArray[np.float64] | None:
    """Return the mean FLIP error (worlds,) of the disc's pixels; None without flip-evaluator."""
    inside = _disc()
    found = []
    for a, b in _displayed(fit, truth):
        pictures = np.zeros((2, DISC, DISC, 3), np.uint8)
        pictures[0, inside], pictures[1, inside] = a, b
        error = flip_error(*pictures, inside)
        if error is None:
            return None
        found.append(error)
    return np.array(found)


def _displayed(
    fit: NDArray[np.float32], truth: NDArray[np.float32]
) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
    """For each world the 8-bit sRGB values (pixels, 3) of both pictures at the same exposure."""
    for a, b, white in zip(fit, truth, whites(truth), strict=True):
        yield srgb(a / white), srgb(b / white)


def whites(truth: NDArray[np.float32]) -> list[float]:
    """Return for each world the radiance that is shown as white."""
    return [max(float(np.percentile(picture, WHITE)), 1e-9) for picture in truth]


def _disc() -> NDArray[np.bool_]:
    """(DISC, DISC) the pixels that show the sphere."""
    axis = (np.arange(DISC) + 0.5) / DISC * 2 - 1
    x, z = np.meshgrid(axis, -axis)
    return np.asarray(x**2 + z**2 < 0.98)
