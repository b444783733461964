"""A sphere under the HDR worlds, with a quadrature that resolves lobes of any width.

spheres.py samples one direction in each of 48 × 96 cells of a world, which is not enough for lobes
narrower than a cell. Here the light directions of a pixel form a grid of half vectors around its
normal, logarithmic in θh. Each direction uses the mean radiance over approximately its solid angle,
from a pyramid of maps. Orthographic view, no shadows or interreflection (a sphere has none).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from patina.core.angles import Angles, half_difference
from patina.core.appearance.layered_model import Configuration

from .spheres import Evaluate, worlds

Floats = NDArray[np.float32]
At = Callable[[Configuration], NDArray[np.floating]]

DISC = 28  # pixels across
NODES = (44, 48)  # numbers of half vectors: logarithmic in θh, uniform in φh over a full turn
KNEE = np.radians(0.3)
BLOCK = 200  # pixels at a time


@dataclass(frozen=True)
class Lit:
    """Pairs of a pixel and a light direction. inside: (h, w), whether a pixel is one of the p
    pixels of the disc; angles, cos_i, cos_o: (p, n); light: (worlds, p, n, 3) L·cosθ·dω, 0 for
    directions below the horizon."""

    inside: NDArray[np.bool_]
    angles: Angles
    cos_i: Floats
    cos_o: Floats
    light: Floats

    def table(self, evaluate: Evaluate) -> Floats:
        """Return the radiance (worlds, p, 3) of a BRDF over half/difference angles."""
        return self._sum(lambda rows: evaluate(Angles(*(a[rows].ravel() for a in self.angles))))

    def model(self, at: At) -> Floats:
        """Return the radiance (worlds, p, 3) of a model that is a function of a Configuration."""

        return self._sum(lambda rows: at(self._where(rows)))

    def subset(self, pixels: NDArray[np.intp]) -> Lit:
        """Return the pairs of some of the p pixels; ``inside`` stays that of all."""
        return Lit(
            self.inside,
            Angles(*(a[pixels] for a in self.angles)),
            self.cos_i[pixels],
            self.cos_o[pixels],
            self.light[:, pixels],
        )

    def columns(self, terms: At) -> Floats:
        """Return the radiance (worlds, p, k, 3) of k reflectances; ``terms`` returns them as (n, k)
        for n configurations."""
        found = []
        for start in range(0, len(self.cos_i), BLOCK):
            rows = slice(start, start + BLOCK)
            shape = self.cos_i[rows].shape
            values = np.asarray(terms(self._where(rows)), np.float32).reshape(*shape, -1)
            light = np.moveaxis(self.light[:, rows], 2, -1)  # (worlds, p, 3, n)
            found.append(np.moveaxis(light @ values, 2, 3))
        return np.concatenate(found, axis=1)

    def _where(self, rows: slice) -> Configuration:
        """The pairs of some pixels."""
        cos_h, cos_d = (np.cos(a[rows].ravel()) for a in self.angles[:2])
        return Configuration(self.cos_i[rows].ravel(), self.cos_o[rows].ravel(), cos_h, cos_d)

    def _sum(self, rho: Callable[[slice], NDArray[np.floating]]) -> Floats:
        found = np.zeros((len(self.light), len(self.cos_i), 3), np.float32)
        for start in range(0, len(self.cos_i), BLOCK):
            rows = slice(start, start + BLOCK)
            values = np.asarray(rho(rows), np.float32).reshape(*self.cos_i[rows].shape, 3)
            found[:, rows] = np.einsum("wpnc,pnc->wpc", self.light[:, rows], values)
        return found


@lru_cache(maxsize=4)
def lit(disc: int = DISC, only: str | None = None) -> Lit:
    """Return the pairs for a disc of diameter ``disc`` pixels; only: name of a single world."""
    axis = (np.arange(disc) + 0.5) / disc * 2 - 1
    x, z = np.meshgrid(axis, -axis)
    inside = x**2 + z**2 < 0.98
    x, z = x[inside], z[inside]
    normal = np.stack([x, -np.sqrt(1 - x**2 - z**2), z], axis=1)  # the camera looks along +y
    view = np.array([0.0, -1.0, 0.0])
    n_h, n_p = NODES
    span = np.log1p(np.pi / 2 / KNEE)
    theta = KNEE * np.expm1((np.arange(n_h) + 0.5) / n_h * span)
    theta, phi = np.meshgrid(theta, (np.arange(n_p) + 0.5) / n_p * 2 * np.pi, indexing="ij")
    solid = ((theta + KNEE) * span / n_h * np.sin(theta) * 2 * np.pi / n_p).ravel()
    local = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    ).reshape(-1, 3)
    tangent = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.6, [1.0, 0, 0], [0, 0, 1.0]))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], axis=1)  # (p, 3, xyz)
    half = local @ frame  # (p, n, 3)
    cos_d = half @ view
    light = 2 * cos_d[..., None] * half - view
    cos_i = np.einsum("pnx,px->pn", light, normal)
    seen = (cos_d > 1e-4) & (cos_i > 1e-4)
    size = np.where(seen, 4 * np.maximum(cos_d, 0) * solid, 1.0)
    weight = np.where(seen, cos_i * size, 0.0)
    names = [only] if only else list(worlds())
    radiance = np.stack([pyramid(name).mean_over(light, size) for name in names])
    angles = half_difference(normal[:, None, :], light, np.broadcast_to(view, light.shape))
    cos_o = np.broadcast_to((normal @ view)[:, None], cos_i.shape)
    return Lit(
        inside,
        Angles(*(a.astype(np.float32) for a in angles)),
        np.maximum(cos_i, 1e-4).astype(np.float32),
        cos_o.astype(np.float32),
        (radiance * weight[..., None]).astype(np.float32),
    )


@dataclass(frozen=True)
class Pyramid:
    """A world as latitude-longitude maps, each with half the resolution of the one before."""

    maps: tuple[Floats, ...]

    def mean_over(self, light: NDArray[np.floating], size: NDArray[np.floating]) -> Floats:
        """Return mean radiance (..., 3) over about ``size`` sr around unit vectors, z up."""
        rows, columns = self.maps[0].shape[:2]
        sine = np.sqrt(np.maximum(1 - light[..., 2] ** 2, 1e-4))
        texel = 2 * np.pi**2 / (rows * columns) * sine
        level = np.clip(0.5 * np.log2(size / texel), 0, len(self.maps) - 1.001)
        low = level.astype(int)
        part = (level - low)[..., None].astype(np.float32)
        v = np.arccos(np.clip(light[..., 2], -1, 1)) / np.pi
        u = np.arctan2(light[..., 1], light[..., 0]) / (2 * np.pi) % 1.0
        found = np.zeros(light.shape, np.float32)
        for k in range(len(self.maps)):
            for offset, share in ((0, 1 - part), (1, part)):
                at = low + offset == k
                if at.any():
                    found[at] += share[at] * _bilinear(self.maps[k], u[at], v[at])
        return found


@lru_cache(maxsize=8)
def pyramid(name: str) -> Pyramid:
    """Return the pyramid of a world that Blender ships."""
    pixels = np.asarray(oiio.ImageBuf(str(worlds()[name])).get_pixels(oiio.FLOAT))[..., :3]
    maps = [pixels[: len(pixels) // 16 * 16, : pixels.shape[1] // 16 * 16].astype(np.float32)]
    while len(maps[-1]) % 2 == 0 and len(maps[-1]) > 8:
        finer = maps[-1]
        h, w = finer.shape[:2]
        area = np.sin((np.arange(h) + 0.5) / h * np.pi).reshape(h // 2, 2, 1, 1, 1)
        blocks = finer.reshape(h // 2, 2, w // 2, 2, 3)
        mean = (blocks * area).sum(axis=(1, 3)) / (2 * area.sum(axis=(1, 3)))
        maps.append(mean.astype(np.float32))
    return Pyramid(tuple(maps))


def _bilinear(image: Floats, u: NDArray[np.floating], v: NDArray[np.floating]) -> Floats:
    h, w = image.shape[:2]
    x, y = u * w - 0.5, np.clip(v * h - 0.5, 0, h - 1.001)
    left, top = np.floor(x).astype(int), y.astype(int)
    a, b = (x - left)[..., None].astype(np.float32), (y - top)[..., None].astype(np.float32)
    right, below = (left + 1) % w, np.minimum(top + 1, h - 1)
    left = left % w
    upper = image[top, left] * (1 - a) + image[top, right] * a
    lower = image[below, left] * (1 - a) + image[below, right] * a
    return np.asarray(upper * (1 - b) + lower * b)
