"""The fit again, on photos without the paint.

A fit takes all of a material for one BRDF. Where its colour varies, dark and light patches pull at
one another, and what they differ by is taken for a lobe's shape or for wrong normals. Once maps
tell what each place of the surface is painted with, every sample can be brought to the typical
paint t, the median of all:

    L' = L · (t·body + specular) / (s·body + specular)

with s the map's scale there and body + specular the BRDF of the fit before. The fit of these
samples is the BRDF of the surface under its paint, and better maps follow from it.
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

CHUNK = 1 << 17
SMALLEST = 0.05  # of the fitted reflectance: no paint is darker by more
NEIGHBOURS = 4  # texels that a sample's scale is taken from


@dataclass(frozen=True)
class Paint:
    """What the surface is painted with, as maps say that were made with these levels."""

    mesh: Mesh
    texels: Texels
    maps: TexelMaps
    levels: tuple[MaterialLevel, ...]

    def removed(self, index: int, table: SampleTable) -> SampleTable:
        """A material's samples as the typical paint would show them."""
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
        """(m, 3) what samples' radiance is multiplied by."""
        count = min(NEIGHBOURS, tree.n)
        away, near = tree.query(table.point[rows], k=count)
        away, near = away.reshape(-1, count), near.reshape(-1, count)
        weight = 1.0 / (away + 1e-6 + 0.1 * away.mean())
        weight /= weight.sum(axis=1, keepdims=True)
        paint = np.einsum("nk,nkc->nc", weight, scale[near])
        level = self.levels[index]
        rho = level.brdf.evaluate(Angles(*(a[rows] for a in table.angles)))
        body, specular = level.split.parts(rho)
        painted = np.maximum(paint * body + specular, SMALLEST * rho)
        return np.asarray((typical * body + specular) / np.maximum(painted, 1e-12), np.float32)


class PaintlessFitJob(FitJob):
    """A FitJob whose samples are rid of their paint first."""

    def __init__(self, capture: Capture, basis: Basis, paint: Paint) -> None:
        super().__init__(capture, basis)
        self.paint = paint

    def given(self, index: int, table: SampleTable) -> SampleTable:
        return self.paint.removed(index, table)


def levels_without_paint(
    capture: Capture, basis: Basis, paint: Paint, tables: Sequence[SampleTable]
) -> Generator[float, None, tuple[MaterialLevel, ...]]:
    """The BRDFs alone, from samples (one table a material) that were taken before; yields the
    fraction done. Raises FitError."""
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
    """Samples in the unit of a material's BRDF: the photos' where irradiance is known."""
    if level.scale == 1.0:
        return table
    unit = np.float32(level.scale)
    return replace(table, rho=table.rho * unit, irradiance=table.irradiance / unit)
