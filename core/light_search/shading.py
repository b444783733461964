"""Radiance of a dictionary of BRDFs under a candidate light, with cast shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ..geometry import RayScene
from ..geometry.view import cast_shadow
from ..light import Light
from .brdf_dictionary import BrdfDictionary
from .cell_albedo import CellAlbedo
from .lamp_photo import LampPhoto
from .log_cost import Measured

Array = NDArray[np.floating]

RIDGE = 1e-6  # relative, where non-negative least squares does not converge


@dataclass(frozen=True)
class LampPixels:
    """The pixels of all photos of one lamp. parts: by photo; measured: (n,) their radiance;
    material: (n,) index of each pixel's material; albedo: (n,) relative to its material's."""

    parts: tuple[LampPhoto, ...]
    measured: Measured
    material: NDArray[np.int16]
    albedo: NDArray[np.float64]

    @classmethod
    def of(cls, photos: Sequence[LampPhoto], most: int) -> LampPixels:
        """At most ``most`` pixels, the same number from each photo."""
        parts = tuple(photo.first(max(most // max(len(photos), 1), 1)) for photo in photos)
        radiance = np.concatenate([part.radiance for part in parts])
        material = np.concatenate([part.material for part in parts])
        return cls(parts, Measured.of(radiance), material, np.ones(len(radiance)))

    def select(self, which: NDArray[np.bool_]) -> LampPixels:
        """The pixels of a mask (n,), with the same offset in the cost."""
        ends = np.cumsum([len(part.material) for part in self.parts])
        masks = np.split(which, ends[:-1])
        return LampPixels(
            tuple(part.select(mask) for part, mask in zip(self.parts, masks, strict=True)),
            replace(self.measured, radiance=self.measured.radiance[which]),
            self.material[which],
            self.albedo[which],
        )

    def first(self, most: int) -> LampPixels:
        """At most ``most`` of the pixels, the same number from each photo."""
        each = max(most // max(len(self.parts), 1), 1)
        kept = [np.arange(len(part.material)) < each for part in self.parts]
        return self.select(np.concatenate(kept))

    def with_albedo(self, albedo: CellAlbedo | None) -> LampPixels:
        """The same pixels with the albedo of their cells."""
        return self if albedo is None else replace(self, albedo=albedo.at(self.points))

    def without_albedo(self) -> LampPixels:
        """The same pixels with an even albedo."""
        return replace(self, albedo=np.ones(len(self.albedo)))

    def times_albedo(self, radiance: NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, k) radiance for an even albedo × the albedo of the pixels."""
        return radiance * self.albedo[:, None].astype(np.float32)

    @property
    def points(self) -> NDArray[np.float64]:
        """(n, 3) scan frame."""
        return np.concatenate([part.point for part in self.parts])

    def dictionary_radiance(
        self, light: Light, rays: RayScene, dictionary: BrdfDictionary
    ) -> NDArray[np.float32]:
        """(n, k) radiance of the BRDFs, for a light of mean irradiance or intensity 1."""
        out = [_photo_radiance(part, light, rays, dictionary) for part in self.parts]
        return self.times_albedo(np.concatenate(out))


def _photo_radiance(
    photo: LampPhoto, light: Light, rays: RayScene, dictionary: BrdfDictionary
) -> NDArray[np.float32]:
    out = np.zeros((len(photo.radiance), dictionary.count), np.float32)
    incidence = light.incidence(photo.point, photo.camera)
    cos_i = np.einsum("ij,ij->i", photo.normal, incidence.towards)
    lit = np.flatnonzero(cos_i > 0)
    towards, normal = incidence.towards[lit], photo.normal[lit]
    distance = None if incidence.distance is None else incidence.distance[lit]
    dark = cast_shadow(rays, photo.point[lit], normal, towards, distance)
    rows = lit[~dark]
    strength = incidence.irradiance[rows].mean(axis=1) * cos_i[rows]
    values = dictionary.evaluate(photo.normal[rows], photo.view[rows], incidence.towards[rows])
    out[rows] = values * strength[:, None].astype(np.float32)
    return out


def predicted(radiance: Array, coefficients: Array, material: NDArray[np.int16]) -> Array:
    """(n,) radiance of the materials. radiance: (n, k) of the dictionary; coefficients: (m, k) of
    the materials; material: (n,) index of each pixel's."""
    if len(coefficients) == 1:
        return np.asarray(radiance @ coefficients[0])
    return np.einsum("ij,ij->i", radiance, coefficients[material])


def non_negative(matrix: Array, target: Array) -> NDArray[np.float64]:
    """(k,) non-negative least squares (Lawson & Hanson 1974)."""
    try:
        return np.asarray(nnls(matrix.astype(np.float64), target)[0])
    except RuntimeError:  # columns nearly alike: it did not converge
        gram = matrix.T @ matrix
        gram = gram + RIDGE * max(float(np.trace(gram)), 1e-30) * np.eye(len(gram))
        return np.maximum(np.linalg.solve(gram, matrix.T @ target), 0.0)
