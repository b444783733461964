"""Texels projected into one photo: position, visibility, and the reflectance that it shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..angles.vectors import dot
from ..capture import Capture
from ..geometry import RayScene
from ..inputs.photos import LitPhoto
from ..light import Light
from ..scan import Camera, Scan
from ..varying.labels import label_pixels
from ..varying.surface_photo import MIN_COSINE, SurfacePhoto, bilinear_corners
from .level import MaterialLevel
from .slots import TexelSamples

Array = NDArray[np.floating]

RELATIVE_ERROR = 0.03  # of the radiance: misregistration, resampling, model error
NOISE = 0.002  # error of dark pixels, as a fraction of the photo's 95th percentile
GRAZING_ERROR = 0.03  # relative, times 1/cos − 1 of light and view: fits are least accurate there
MIN_SPECULAR_SHARE = 0.1  # of the reflectance: with less, a sample has no information on gloss
SPECULAR_ERROR = 0.25  # of the specular part, since the gloss of the surface may vary


@dataclass(frozen=True)
class PhotoSampler(SurfacePhoto):
    """One photo, prepared for sampling texels. bright: the 95th percentile of the mean radiance of
    reliable pixels. levels: the fitted materials, in the order of the capture."""

    levels: tuple[MaterialLevel, ...]
    bright: float

    @classmethod
    def of(
        cls,
        capture: Capture,
        scan: Scan,
        rays: RayScene,
        camera: Camera,
        place: int,
        photo: LitPhoto,
        light: Light,
        levels: tuple[MaterialLevel, ...],
    ) -> PhotoSampler:
        """Label the pixels of the photo and measure the radiance of its bright pixels."""
        labels = label_pixels(capture, scan, rays, camera, place, photo, light)
        lit = photo.radiance[labels.trusted > 0].mean(axis=1)
        bright = float(np.percentile(lit, 95)) if len(lit) else 0.0
        return cls(rays, camera, light, photo.radiance, labels, levels, bright)

    def at(self, points: Array, normals: Array) -> tuple[TexelSamples, NDArray[np.intp], Array]:
        """(samples of the texels that are visible and lit; rows (k,) of all visible texels; their
        votes (k, materials), the bilinear share of the pixels that show each material, times cos
        θo).

        points, normals: (n, 3) of the texels, scan frame."""
        facing, view, pixels = self.facing(points, normals)
        weights, corners = bilinear_corners(pixels, self.camera)
        shown = self.labels.shown.ravel()[corners]
        some = (shown > 0).any(axis=1)
        facing, view, weights, corners, shown = (
            a[some] for a in (facing, view, weights, corners, shown)
        )
        seen = ~self.hidden(points[facing], normals[facing], view)
        facing, view, weights, corners, shown = (
            a[seen] for a in (facing, view, weights, corners, shown)
        )
        cos_o = dot(normals[facing].astype(np.float32), view.astype(np.float32))
        votes = np.zeros((len(facing), len(self.levels)), np.float32)
        for index in range(len(self.levels)):
            votes[:, index] = cos_o * np.sum(weights * (shown == index + 1), axis=1)
        trusted = self.labels.trusted.ravel()[corners]
        good = (trusted > 0).all(axis=1) & (trusted == trusted[:, :1]).all(axis=1)
        rows = np.flatnonzero(good)
        samples = self._samples(
            points, normals, facing[rows], view[rows], weights[rows], corners[rows],
            trusted[rows, 0] - 1,
        )  # fmt: skip
        return samples, facing, votes

    def _samples(
        self,
        points: Array,
        normals: Array,
        texel: NDArray[np.intp],
        view: Array,
        weights: Array,
        corners: NDArray[np.intp],
        material: NDArray[np.uint8],
    ) -> TexelSamples:
        """The body's scale and its error from the pixels around each texel, for lit texels.

        points, normals: (n, 3); texel: (k,) rows of these; view: (k, 3); weights, corners: (k, 4)
        bilinear weights and flat pixels; material: (k,)."""
        point, normal = points[texel], normals[texel]
        incidence = self.light.incidence(point, self.camera)
        cos_i = np.einsum("ij,ij->i", normal, incidence.towards)
        lit = np.flatnonzero((cos_i > MIN_COSINE) & (incidence.irradiance > 1e-30).all(axis=1))
        some = incidence.select(lit)
        point, normal = point[lit], normal[lit]
        lit = lit[~self.shadowed(point, normal, some)]
        texel, material, cos_i = texel[lit], material[lit], cos_i[lit]
        view, weights, corners = view[lit], weights[lit], corners[lit]
        incidence, normal = incidence.select(lit), normals[texel]
        flat = self.radiance.reshape(-1, 3)
        radiance = np.einsum("nj,njc->nc", weights, flat[corners])
        single = [a.astype(np.float32) for a in (normal, incidence.towards, view)]
        angles = half_difference(*single)
        brightness = incidence.irradiance * cos_i[:, None]
        reflected = radiance / brightness
        noise = NOISE * self.bright / brightness.mean(axis=1)
        cos_o = np.einsum("ij,ij->i", normal, view)
        sine = np.sqrt(np.maximum(1 - cos_i**2, 0))
        n = len(texel)
        scale, error, specular, gloss = np.empty((n, 3)), np.empty(n), np.empty(n), np.empty(n)
        for index, level in enumerate(self.levels):
            own = np.flatnonzero(material == index)
            if not len(own):
                continue
            part = level.at(type(angles)(*(a[own] for a in angles)))
            rho = reflected[own] * level.scale
            grey = rho.mean(axis=1)
            body = np.maximum(part.body.mean(axis=1), 1e-9)
            shine = part.specular.mean(axis=1)
            tilt = level.normal_error * sine[own] / cos_i[own]
            steep = GRAZING_ERROR * (1 / cos_i[own] + 1 / cos_o[own] - 2)
            variance = (
                (level.scale * noise[own]) ** 2
                + (RELATIVE_ERROR**2 + tilt**2 + steep**2) * grey**2
                + (SPECULAR_ERROR * shine) ** 2
                + part.slope**2
            )
            scale[own] = (rho - part.specular) / np.maximum(part.body, 1e-9)
            error[own] = np.sqrt(variance) / body
            specular[own] = shine / np.maximum(shine + body, 1e-12)
            shiny = level.split.whole | (specular[own] > MIN_SPECULAR_SHARE)
            gloss[own] = np.where(shiny, part.gloss / body, 0.0)
        return TexelSamples(texel, scale, error, specular, gloss, material)
