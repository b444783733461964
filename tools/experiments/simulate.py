"""Simulate photos of the exact surface, and sample them with the scanned mesh.

Rays intersect the true mesh with its smooth normals. The true BRDF is the neural encoding; light is
direct, with cast shadows; the camera has shot and read noise. Patina's own code then takes the
samples with the scanned mesh. Geometry is computed once per pair of meshes, so that each material
only costs one evaluation of its network.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles, half_difference
from patina.core.geometry import RayScene, view_surface
from patina.core.light import DistantLight
from patina.core.samples import Margins, SampleTable, sample_photo
from patina.core.samples.take import light_surface, trusted_pixels
from patina.core.scan import Camera, Mesh

Evaluate = Callable[[Angles], NDArray[np.floating]]

SUB = 2  # rays per pixel and axis: highlights on thin parts are narrower than a pixel
FULL_WELL = 20_000  # electrons at the white level: var = radiance·white/FULL_WELL + read²
READ_NOISE = 4.0  # electrons
WHITE = 99.0  # percentile of the radiance that is the white level; exposures are bracketed above it


@dataclass(frozen=True)
class Shot:
    """One lit photo: its camera and light."""

    camera: Camera
    light: DistantLight


@dataclass(frozen=True)
class TruePixels:
    """The true surface in selected pixels, s = SUB × SUB points per pixel. angles: (n, s) float32;
    shading: (n, s) float32, max(n·l, 0), 0 in cast shadow and where the ray misses; hit: (n,)
    fraction of the pixel that shows the surface."""

    angles: Angles
    shading: NDArray[np.float32]
    hit: NDArray[np.float32]

    def select(self, rows: NDArray) -> TruePixels:
        """The rows of a boolean mask or an index array."""
        return TruePixels(
            Angles(*(a[rows] for a in self.angles)), self.shading[rows], self.hit[rows]
        )

    @staticmethod
    def join(parts: Sequence[TruePixels]) -> TruePixels:
        """Concatenate."""
        return TruePixels(
            Angles(*(np.concatenate([p.angles[k] for p in parts]) for k in range(3))),
            np.concatenate([p.shading for p in parts]),
            np.concatenate([p.hit for p in parts]),
        )

    def transport(self, evaluate: Evaluate) -> NDArray[np.float32]:
        """Return (n, 3) means over the pixels of ρ·max(n·l, 0): radiance for irradiance 1."""
        out = np.zeros((*self.shading.shape, 3), np.float32)
        lit = self.shading > 0
        rho = evaluate(Angles(*(a[lit] for a in self.angles)))
        out[lit] = rho * self.shading[lit, None]
        return np.asarray(out.mean(axis=1), np.float32)


def true_pixels(rays: RayScene, shot: Shot, sub: int = SUB) -> TruePixels:
    """Return the true surface in all h·w pixels of a photo, in row-major order."""
    width, height = shot.camera.width, shot.camera.height
    fine = shot.camera.resized(sub * width, sub * height)
    view = view_surface(rays, fine)
    lighting = light_surface(rays, view, shot.light, fine)
    angles = half_difference(view.normal, lighting.incidence.towards, view.view)
    full = []
    shading = np.where(lighting.shadowed, 0.0, lighting.cos_i)
    for values in (*angles, shading, np.ones(len(shading))):
        image = view.image(values.astype(np.float32), fill=0.0)
        blocks = image.reshape(height, sub, width, sub).transpose(0, 2, 1, 3)
        full.append(np.ascontiguousarray(blocks.reshape(height * width, sub * sub)))
    return TruePixels(Angles(*full[:3]), full[3], full[4].mean(axis=1))


@dataclass(frozen=True)
class Sampled:
    """Geometry of the samples of a scanned mesh, without radiance.

    table: samples with the geometry of the scan; radiance and ρ are 0. true: the true surface in
    the pixel of each row. photos: number of photos.
    """

    table: SampleTable
    true: TruePixels
    photos: int

    def photograph(self, evaluate: Evaluate, seed: int | None = 0) -> SampleTable:
        """Return the samples for this BRDF; seed None: without noise."""
        return self.exposed(self.true.transport(evaluate), seed)

    def exposed(self, transport: NDArray[np.float32], seed: int | None = 0) -> SampleTable:
        """As :meth:`photograph`, from the result (n, 3) of TruePixels.transport."""
        radiance = transport * self.table.irradiance
        variance = np.zeros_like(radiance)
        if seed is not None:
            white = np.float32(np.percentile(radiance, WHITE) / FULL_WELL)
            variance = radiance * white + np.square(READ_NOISE * white)
            noise = np.random.default_rng(seed).standard_normal(radiance.shape, np.float32)
            radiance = radiance + np.sqrt(variance) * noise
        rho = radiance / (self.table.irradiance * self.table.cos_i[:, None])
        return replace(
            self.table,
            radiance=radiance.astype(np.float32),
            variance=variance.astype(np.float32),
            rho=rho.astype(np.float32),
        )

    def select(self, rows: NDArray) -> Sampled:
        """The rows of a boolean mask or an index array."""
        return Sampled(self.table.select(rows), self.true.select(rows), self.photos)

    def first_photos(self, count: int) -> Sampled:
        """Return the samples of the first photos."""
        return replace(self.select(self.table.photo < count), photos=count)


def sample_scanned(
    true_mesh: Mesh,
    scanned: Mesh,
    shots: Sequence[Shot],
    margins: Margins | None = None,
    trusted: bool = True,
) -> Sampled:
    """Return the geometry of all samples that Patina would use.

    trusted False: include all lit pixels that show the scan, for comparison with a prediction.
    """
    true_rays, rays = RayScene.build(true_mesh), RayScene.build(scanned)
    tables, trues = [], []
    for shot in shots:
        view = view_surface(rays, shot.camera)
        lighting = light_surface(rays, view, shot.light, shot.camera)
        keep = (
            trusted_pixels(view, lighting, margins or Margins()) if trusted else ~lighting.shadowed
        )
        empty = np.zeros((shot.camera.width * shot.camera.height, 3), np.float32)
        table = sample_photo(view, lighting, empty, keep)
        tables.append(table)
        trues.append(true_pixels(true_rays, shot).select(table.pixel))
    return Sampled(SampleTable.join(tables), TruePixels.join(trues), len(shots))
