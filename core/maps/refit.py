"""The refit of the BRDF to samples with the colour variation ("paint") removed.

A fit assumes one BRDF for a material. If its colour varies, the differences between dark and light
areas bias the shape of the lobe and the normals. The maps give the scale s of the diffuse body at
each point of the surface. Every sample is then converted to the typical scale t, the median:

    L' = L · (t·body + specular) / (s·body + specular)

where body + specular is the BRDF of the previous fit. The fit of these samples is the BRDF without
the variation, and it gives better maps.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..angles import Angles
from ..basis import Basis
from ..capture import Capture
from ..concurrency.background import in_background
from ..fit.measured_result import MeasuredResult
from ..jobs.estimators import estimate
from ..jobs.fit_job import FitJob
from ..samples import SampleTable
from ..scan import Mesh
from .level import MaterialLevel
from .settle import TexelMaps
from .texels import Texels

CHUNK = 1 << 17  # samples processed at once, to limit memory
MIN_REFLECTANCE_RATIO = 0.05  # of painted to fitted reflectance: limits the conversion factor
NEIGHBOURS = 4  # texels that the scale of a sample is interpolated from


@dataclass(frozen=True)
class Paint:
    """The colour variation of the surface: the maps, and the materials they were made with."""

    mesh: Mesh
    texels: Texels
    maps: TexelMaps
    levels: tuple[MaterialLevel, ...]

    def removed(self, index: int, table: SampleTable) -> SampleTable:
        """The samples of material ``index``, converted to its typical (median) scale."""
        scale = self.maps.materials[index].scale
        known = np.flatnonzero(self.maps.material == index)
        if not len(known):
            return table
        points = np.empty((len(known), 3))
        for begin in range(0, len(known), CHUNK):
            part = known[begin : begin + CHUNK]
            points[begin : begin + CHUNK] = self.texels.points(self.mesh, part)
        tree = cKDTree(points)
        typical = np.median(scale[known], axis=0)
        factor = np.empty((len(table), 3), np.float32)
        for begin in range(0, len(table), CHUNK):
            rows = slice(begin, begin + CHUNK)
            factor[rows] = self._factor(index, table, rows, tree, scale[known], typical)
        return replace(table, rho=table.rho * factor, radiance=table.radiance * factor)

    def _factor(
        self,
        index: int,
        table: SampleTable,
        rows: slice,
        tree: cKDTree,
        scale: NDArray[np.float32],
        typical: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """(m, 3) conversion factor of the radiance of the samples ``rows``."""
        count = min(NEIGHBOURS, tree.n)
        away, near = tree.query(table.point[rows], k=count)
        away, near = away.reshape(-1, count), near.reshape(-1, count)
        weight = 1.0 / (away + 1e-6 + 0.1 * away.mean())
        weight /= weight.sum(axis=1, keepdims=True)
        paint = np.einsum("nk,nkc->nc", weight, scale[near])
        level = self.levels[index]
        rho = level.brdf.evaluate(Angles(*(a[rows] for a in table.angles)))
        body, specular = level.split.parts(rho)
        painted = np.maximum(paint * body + specular, MIN_REFLECTANCE_RATIO * rho)
        return np.asarray((typical * body + specular) / np.maximum(painted, 1e-12), np.float32)


class PaintlessFitJob(FitJob):
    """A FitJob that removes the colour variation from its samples first."""

    def __init__(self, capture: Capture, basis: Basis, paint: Paint) -> None:
        super().__init__(capture, basis)
        self.paint = paint

    def samples_to_fit(self, index: int, table: SampleTable) -> SampleTable:
        """The samples of a material with the colour variation removed."""
        return self.paint.removed(index, table)

    def limits_to_fit(self, index: int, clipped: SampleTable | None) -> None:
        """None: what the colour variation has to do with a lower limit is not known."""
        return None


def levels_without_paint(
    capture: Capture, basis: Basis, paint: Paint, tables: Sequence[SampleTable]
) -> Generator[float, None, tuple[MaterialLevel, ...]]:
    """Fit the BRDFs only, to existing samples (one table for each material) with the colour
    variation removed; yields the fraction done. Raises FitError."""
    quick = replace(capture, fit=replace(capture.fit, held_out=False))
    found = []
    for index, table in enumerate(tables):
        level = paint.levels[index]
        done = index / len(tables)
        plain = yield from in_background(partial(paint.removed, index, scaled(table, level)), done)
        steps = estimate(plain, basis, quick, level.name)
        while True:
            try:
                yield (index + next(steps)[1]) / len(tables)
            except StopIteration as end:
                fit = end.value.fit
                break
        off = fit.normal_deviation if isinstance(fit, MeasuredResult) else 0.0
        found.append(MaterialLevel.of(level.name, fit.brdf, level.scale, off))
    return tuple(found)


def scaled(table: SampleTable, level: MaterialLevel) -> SampleTable:
    """Samples in the scale of the material's BRDF; unchanged where the irradiance is known."""
    if level.scale == 1.0:
        return table
    unit = np.float32(level.scale)
    return replace(table, rho=table.rho * unit, irradiance=table.irradiance / unit)
