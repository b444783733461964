"""The picture of a sphere with the material, lit by a key light and a rim light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference
from ..appearance.layered_model import Configuration
from ..appearance.lobe_stack import LobeStack
from ..appearance.principled import Principled
from ..photo import write_png
from . import display

KEY = np.array([-0.5, 0.6, 0.62])  # direction to the key light: left, above, in front
RIM = np.array([0.85, 0.25, -0.30])
RIM_STRENGTH = 0.7

Reflector = Callable[[Angles], NDArray[np.floating]] | Principled | LobeStack
"""A function (angles -> ρ (n, 3) in 1/sr), or a model that is not reciprocal in light and view."""


@dataclass(frozen=True)
class LitPart:
    """The part of a sphere that one light reaches. places: (n,) indices into the points inside;
    normal (n, 3), light (1, 3), view (n, 3): unit vectors; factor: (n,) irradiance, by which ρ is
    multiplied."""

    places: NDArray[np.intp]
    normal: NDArray[np.float64]
    light: NDArray[np.float64]
    view: NDArray[np.float64]
    factor: NDArray[np.float64]

    @property
    def angles(self) -> Angles:
        """Half/difference angles, (n,) each."""
        return half_difference(self.normal, self.light, self.view)


@dataclass(frozen=True)
class LitSphere:
    """The geometry of a sphere under two distant lights, ``size`` pixels wide, without a material.

    Orthographic view along −z; the key light has irradiance π, so that a white diffuse sphere
    reaches radiance 1. inside: (m, m) True on the sphere, m = size · oversample.
    """

    size: int
    oversample: int
    inside: NDArray[np.bool_]
    parts: tuple[LitPart, ...]

    @classmethod
    def of(cls, size: int, oversample: int = 2) -> LitSphere:
        n = size * oversample
        axis = (np.arange(n) + 0.5) / n * 2.1 - 1.05
        x, y = np.meshgrid(axis, -axis)
        inside = x**2 + y**2 < 1.0
        normal = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)[inside]
        view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), normal.shape)
        parts = []
        for direction, strength in ((KEY, 1.0), (RIM, RIM_STRENGTH)):
            light = direction / np.linalg.norm(direction)
            cos_i = normal @ light
            lit = cos_i > 0
            factor = strength * np.pi * cos_i[lit]
            parts.append(
                LitPart(np.flatnonzero(lit), normal[lit], light[None, :], view[lit], factor)
            )
        return cls(size, oversample, inside, tuple(parts))

    def picture(
        self, rho: Sequence[NDArray[np.floating]]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(radiance (size, size, 3), coverage (size, size)); rho: (n, 3) in 1/sr of each part."""
        radiance = np.zeros((int(self.inside.sum()), 3), np.float32)
        for part, own in zip(self.parts, rho, strict=True):
            radiance[part.places] += (part.factor[:, None] * own).astype(np.float32)
        image = np.zeros((*self.inside.shape, 3), np.float32)
        image[self.inside] = radiance
        size, each = self.size, self.oversample
        blocks = image.reshape(size, each, size, each, 3).mean(axis=(1, 3))
        coverage = self.inside.reshape(size, each, size, each).mean(axis=(1, 3))
        return blocks, coverage.astype(np.float32)


def lit_sphere(
    reflector: Reflector, size: int = 320, oversample: int = 2
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(radiance (size, size, 3), coverage (size, size)) of a LitSphere with this reflector."""
    sphere = LitSphere.of(size, oversample)
    return sphere.picture([_reflectance(reflector, part) for part in sphere.parts])


def write_sphere(path: Path, reflector: Reflector) -> None:
    """Write the picture as a PNG with a transparent background."""
    sphere, coverage = lit_sphere(reflector)
    alpha = (coverage * 255 + 0.5).astype(np.uint8)
    write_png(path, np.dstack([display.srgb(sphere), alpha]))


def _reflectance(reflector: Reflector, part: LitPart) -> NDArray[np.floating]:
    """ρ (n, 3) in 1/sr at the points of a part."""
    if isinstance(reflector, (Principled, LobeStack)):
        return reflector.at(Configuration.around(part.normal, part.light, part.view))
    return reflector(part.angles)
