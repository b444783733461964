"""A few measured BRDFs whose non-negative sums stand for an unknown material.

While a light is unknown, the material must be flexible enough for cloth and for metal, but must not
explain a wrong light by a reflectance that no surface has. Non-negative sums of measured BRDFs are
both: each of them is a possible BRDF.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import Basis

Array = NDArray[np.floating]

COUNT = 12  # BRDFs; with 12 the farthest of the 100 MERL materials is near one of them
N_HALF, N_DIFFERENCE, N_AZIMUTH = 48, 16, 8  # nodes in θh (denser at 0) and θd; φd is averaged
LOG_OFFSET = 0.02  # of a BRDF's level: below it, differences between materials do not count


@dataclass(frozen=True)
class BrdfDictionary:
    """table: (N_HALF · N_DIFFERENCE, k) float32, the BRDFs on nodes of θh and θd, each with mean 1
    over the hemisphere of half vectors."""

    table: NDArray[np.float32]

    @property
    def count(self) -> int:
        """k, the number of BRDFs."""
        return int(self.table.shape[1])

    @classmethod
    def of(cls, basis: Basis, count: int = COUNT) -> BrdfDictionary:
        """``count`` of the materials that the basis was computed from, as different as possible.

        The first is the one nearest to the mean, each further one the farthest from those chosen
        (Gonzalez 1985). Raises ValueError for a basis without its training coefficients.
        """
        if basis.training is None:
            raise ValueError("the basis has no training coefficients")
        theta_h = np.linspace(0.0, 1.0, N_HALF) ** 2 * (np.pi / 2)
        theta_d = np.linspace(0.0, np.pi / 2, N_DIFFERENCE)
        phi_d = (np.arange(N_AZIMUTH) + 0.5) / N_AZIMUTH * np.pi
        each = np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")
        nodes = Angles(*(a.ravel() for a in each))
        area = np.sin(theta_h)[:, None] * np.gradient(theta_h)[:, None] * np.cos(theta_d)[None]
        tables = []
        for start in range(0, len(basis.training) - 2, 3):  # R, G and B of a material
            rho = basis.evaluate(basis.training[start : start + 3], nodes).mean(axis=1)
            table = rho.reshape(N_HALF, N_DIFFERENCE, N_AZIMUTH)
            there = np.maximum((table > 0).sum(axis=2), 1)  # below the horizon ρ is 0
            mean = np.maximum(table, 0.0).sum(axis=2) / there
            tables.append((mean / ((mean * area).sum() / area.sum())).ravel())
        found = np.array(tables, np.float32)
        return cls(np.ascontiguousarray(found[_farthest_points(found, count)].T))

    def evaluate(self, normal: Array, view: Array, towards: Array) -> NDArray[np.float32]:
        """(n, k) the BRDFs for unit vectors (n, 3): normal, surface → camera, surface → light."""
        half = view + towards
        length = np.maximum(np.linalg.norm(half, axis=1), 1e-9)
        cos_h = np.clip(np.einsum("ij,ij->i", normal, half) / length, 0.0, 1.0)
        cos_d = np.clip(np.einsum("ij,ij->i", towards, half) / length, 0.0, 1.0)
        row = np.sqrt(np.arccos(cos_h) / (np.pi / 2)) * (N_HALF - 1)
        column = np.arccos(cos_d) / (np.pi / 2) * (N_DIFFERENCE - 1)
        i = np.minimum(row.astype(np.intp), N_HALF - 2)
        j = np.minimum(column.astype(np.intp), N_DIFFERENCE - 2)
        a = (row - i).astype(np.float32)[:, None]
        b = (column - j).astype(np.float32)[:, None]
        first = i * N_DIFFERENCE + j
        table = self.table
        out = table.take(first, axis=0) * ((1 - a) * (1 - b))
        out += table.take(first + 1, axis=0) * ((1 - a) * b)
        out += table.take(first + N_DIFFERENCE, axis=0) * (a * (1 - b))
        out += table.take(first + N_DIFFERENCE + 1, axis=0) * (a * b)
        return np.asarray(out, np.float32)


def _farthest_points(tables: NDArray[np.float32], count: int) -> list[int]:
    """Indices of ``count`` rows that are far from one another in the logarithm."""
    logs = np.log(tables + LOG_OFFSET)
    chosen = [int(np.argmin(np.square(logs - logs.mean(axis=0)).sum(axis=1)))]
    distance = np.square(logs - logs[chosen[0]]).sum(axis=1)
    while len(chosen) < min(count, len(tables)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.square(logs - logs[chosen[-1]]).sum(axis=1))
    return chosen
