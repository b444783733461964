"""The samples of a band of texels from all photos, the scale of each texel, and the mask votes."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..concurrency.job import Step
from ..scan import Mesh
from .level import MaterialLevel
from .look import PhotoSampler
from .slots import TexelSlots
from .solve import TexelScales, solve_texels
from .texels import Texels

CHUNK = 1 << 17  # texels processed at once, to limit memory


@dataclass(frozen=True)
class Gathered:
    """Results for n texels. scales: of each texel; photos: (n,) uint16, number of photos that show
    it lit; votes: (n, materials) float32, votes of the photos' masks for each material; material:
    (n,) uint8, the one with most votes."""

    scales: TexelScales
    photos: NDArray[np.uint16]
    votes: NDArray[np.float32]
    material: NDArray[np.uint8]

    @staticmethod
    def join(parts: list[Gathered]) -> Gathered:
        """Concatenate bands in order."""
        names = [f.name for f in fields(TexelScales)]
        scales = TexelScales(
            **{n: np.concatenate([getattr(p.scales, n) for p in parts]) for n in names}
        )
        return Gathered(
            scales=scales,
            photos=np.concatenate([p.photos for p in parts]),
            votes=np.concatenate([p.votes for p in parts]),
            material=np.concatenate([p.material for p in parts]),
        )


def gather_band(
    mesh: Mesh,
    texels: Texels,
    band: slice,
    looks: Iterable[tuple[Step, PhotoSampler]],
    levels: tuple[MaterialLevel, ...],
) -> Generator[Step, None, Gathered]:
    """Sample the texels ``band`` in one photo after the other, then solve for their scales."""
    n = band.stop - band.start
    slots, votes = TexelSlots.empty(n), np.zeros((n, len(levels)), np.float32)
    for step, look in looks:
        yield step
        for start in range(0, n, CHUNK):
            rows = slice(band.start + start, band.start + min(start + CHUNK, n))
            points, normals = texels.points(mesh, rows), texels.normals(mesh, rows)
            samples, seen, photo_votes = look.at(points, normals)
            votes[seen + start] += photo_votes
            slots.add(samples.moved(start))
    material = votes.argmax(axis=1).astype(np.uint8)
    channels = np.stack([level.channels for level in levels])
    parts = [
        solve_texels(slots, material, slice(start, min(start + CHUNK, n)), channels)
        for start in range(0, n, CHUNK)
    ]
    names = [f.name for f in fields(TexelScales)]
    scales = TexelScales(**{k: np.concatenate([getattr(p, k) for p in parts]) for k in names})
    return Gathered(scales, slots.count, votes, material)
