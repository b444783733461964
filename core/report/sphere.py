"""A lit sphere: the picture by which a material is recognised."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference
from ..appearance.lobe_stack import LobeStack
from ..appearance.principled import Configuration, Principled
from ..photo import write_png
from . import display

KEY = np.array([-0.5, 0.6, 0.62])  # left, above, in front
RIM = np.array([0.85, 0.25, -0.30])
RIM_STRENGTH = 0.7

Reflector = Callable[[Angles], NDArray[np.floating]] | Principled | LobeStack
"""A table (angles -> ρ (n, 3) in 1/sr), or a model of which light and view are not alike."""


def lit_sphere(
    reflector: Reflector, size: int = 320, oversample: int = 2
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(radiance (size, size, 3), coverage (size, size)) of a sphere under two distant lights.

    Orthographic view along −z; key light of irradiance π, so that a
    white matte sphere reaches 1.
    """
    n = size * oversample
    axis = (np.arange(n) + 0.5) / n * 2.1 - 1.05
    x, y = np.meshgrid(axis, -axis)
    inside = x**2 + y**2 < 1.0
    normal = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)[inside]
    view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), normal.shape)
    radiance = np.zeros((len(normal), 3), np.float32)
    for direction, strength in ((KEY, 1.0), (RIM, RIM_STRENGTH)):
        light = direction / np.linalg.norm(direction)
        cos_i = normal @ light
        lit = cos_i > 0
        rho = _reflectance(reflector, normal[lit], light[None, :], view[lit])
        radiance[lit] += (strength * np.pi * cos_i[lit, None] * rho).astype(np.float32)
    image = np.zeros((n, n, 3), np.float32)
    image[inside] = radiance
    blocks = image.reshape(size, oversample, size, oversample, 3).mean(axis=(1, 3))
    coverage = inside.reshape(size, oversample, size, oversample).mean(axis=(1, 3))
    return blocks, coverage.astype(np.float32)


def write_sphere(path: Path, reflector: Reflector) -> None:
    """The picture as a PNG, transparent beside the sphere."""
    sphere, coverage = lit_sphere(reflector)
    alpha = (coverage * 255 + 0.5).astype(np.uint8)
    write_png(path, np.dstack([display.srgb(sphere), alpha]))


def _reflectance(
    reflector: Reflector,
    normal: NDArray[np.floating],
    light: NDArray[np.floating],
    view: NDArray[np.floating],
) -> NDArray[np.floating]:
    """ρ (n, 3) in 1/sr for unit vectors (n, 3)."""
    if isinstance(reflector, (Principled, LobeStack)):
        return reflector.at(Configuration.around(normal, light, view))
    return reflector(half_difference(normal, light, view))
