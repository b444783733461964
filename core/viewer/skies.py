"""Skies of the viewer: two that are computed, and photographed ones reduced to a small picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HEIGHT = 96  # pixels of a reduced picture: 1.9° each
COMPUTED_HEIGHT = 96


@dataclass(frozen=True)
class Sky:
    """radiance: (height, width, 3), linear, the zenith in row 0, columns as in Cycles' environment
    textures (equirectangular)."""

    name: str
    radiance: NDArray[np.float32]

    @classmethod
    def reduced(cls, name: str, radiance: NDArray[np.floating]) -> Sky:
        """From a picture (h, w, 3) of any size, averaged by solid angle to HEIGHT rows."""
        height, width = radiance.shape[:2]
        if height <= HEIGHT:
            return cls(name, radiance.astype(np.float32))
        rows = _shares(height, HEIGHT, np.sin(np.pi * (np.arange(height) + 0.5) / height))
        columns = _shares(width, 2 * HEIGHT, np.ones(width))
        averaged = np.einsum("ah,hwc,bw->abc", rows, radiance, columns, optimize=True)
        return cls(name, averaged.astype(np.float32))


def computed_skies() -> list[Sky]:
    """A studio with two softboxes and an overcast sky (CIE standard overcast, Moon and Spencer
    1942), each with irradiance π on a surface that faces up."""
    rows, columns = COMPUTED_HEIGHT, 2 * COMPUTED_HEIGHT
    theta = np.pi * (np.arange(rows) + 0.5)[:, None] / rows
    phi = 2 * np.pi * (0.5 - (np.arange(columns) + 0.5)[None, :] / columns)
    direction = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1
    )
    z = direction[..., 2]
    overcast = np.where(z > 0, (1 + 2 * z) / 3, 0.12)
    studio = np.full(z.shape, 0.05)
    for centre, size, level in (((-0.75, -0.45, 0.55), 0.42, 9.0), ((0.9, -0.2, 0.25), 0.25, 3.0)):
        middle = np.array(centre) / np.linalg.norm(centre)
        right = np.cross([0.0, 0.0, 1.0], middle)
        right /= np.linalg.norm(right)
        above = np.cross(middle, right)
        depth = np.maximum(direction @ middle, 1e-6)
        across = np.maximum(abs(direction @ right), abs(direction @ above)) / depth
        studio = np.where((direction @ middle > 0) & (across < size), level, studio)
    return [
        Sky("Studio", _levelled(studio, theta)),
        Sky("Overcast", _levelled(overcast, theta)),
    ]


def _levelled(grey: NDArray[np.floating], theta: NDArray[np.floating]) -> NDArray[np.float32]:
    """(h, w, 3) grey radiance with irradiance π on a surface that faces up."""
    rows, columns = grey.shape
    solid = np.sin(theta) * (np.pi / rows) * (2 * np.pi / columns)
    irradiance = float(np.sum(grey * solid * np.maximum(np.cos(theta), 0)))
    return np.repeat(grey[..., None] * (np.pi / irradiance), 3, axis=2).astype(np.float32)


def _shares(pixels: int, cells: int, weight: NDArray[np.floating]) -> NDArray[np.float64]:
    """(cells, pixels) weights of a mean over the pixels that each cell covers, in part or whole."""
    edges = np.linspace(0, pixels, cells + 1)
    low, high = edges[:-1, None], edges[1:, None]
    place = np.arange(pixels)[None, :]
    share = np.clip(np.minimum(high, place + 1) - np.maximum(low, place), 0, 1) * weight
    return share / share.sum(axis=1, keepdims=True)
