"""Scale reflectance of unknown scale to the level of the measured materials."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..basis import Basis, mapping
from .table import SampleTable
from .weighted import median


def at_typical_level(table: SampleTable, basis: Basis) -> tuple[SampleTable, float]:
    """(the table with ρ multiplied, the factor).

    Nielsen's mapping has a fixed ε and a mean, so it depends on scale. Where the irradiance is
    unknown the samples are first scaled so that their median ρ·cosMap is that of the basis' mean
    material at the same angles. The fit then does not depend on the unit of the photos.
    """
    factor = typical_factor([table], basis)
    return multiplied(table, factor), factor


def typical_factor(tables: Iterable[SampleTable], basis: Basis) -> float:
    """One factor for the samples of several materials under the same light, so that a dark one
    stays darker than a bright one: the geometric mean of those of each, weighted by the numbers of
    samples."""
    logs, counts = [], []
    for table in tables:
        some = table.select(np.arange(0, len(table), max(1, len(table) // 20_000)))
        centre, _ = basis.rows(some.angles, 0)
        typical = median(np.exp(centre) - mapping.EPSILON, some.weight)
        measured = median(some.rho.mean(axis=1) * mapping.cos_map(some.angles), some.weight)
        logs.append(np.log(typical / measured))
        counts.append(len(table))
    return float(np.exp(np.average(logs, weights=counts)))


def multiplied(table: SampleTable, factor: float) -> SampleTable:
    """The table with ρ multiplied by a factor, and irradiance divided by it."""
    if factor == 1:
        return table
    rho, irradiance = table.rho * np.float32(factor), table.irradiance / np.float32(factor)
    return replace(table, rho=rho, irradiance=irradiance)
