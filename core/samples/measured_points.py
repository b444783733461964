"""The samples that a chart shows with its curves: few enough to store, spread over the sampled
directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from .reservoir import sample_hash, water_level
from .table import SampleTable

MAX_POINTS = 6000
CELLS = (
    30,
    15,
)  # in √θh and θd: the points are shared out between cells, so that highlights keep some


@dataclass(frozen=True)
class MeasuredPoints:
    """n samples of one material. angles: (n,) each, radians, of the scanned normal; rho: (n, 3) in
    1/sr; photo: (n,) index of the photo."""

    angles: Angles
    rho: NDArray[np.float32]
    photo: NDArray[np.int16]

    def __len__(self) -> int:
        return len(self.photo)

    def select(self, which: NDArray) -> MeasuredPoints:
        """The rows of a boolean mask or an index array."""
        return MeasuredPoints(
            Angles(*(a[which] for a in self.angles)), self.rho[which], self.photo[which]
        )

    @staticmethod
    def of(table: SampleTable, most: int = MAX_POINTS) -> MeasuredPoints:
        """At most ``most`` complete samples of a table (SampleTable.read); the choice does not
        depend on their order."""
        if not (read := table.read).all():
            table = table.select(read)
        across, along = CELLS
        column = np.sqrt(table.theta_h / (np.pi / 2)) * across
        row = table.theta_d / (np.pi / 2) * along
        cell = np.clip(column.astype(int), 0, across - 1) * along
        cell += np.clip(row.astype(int), 0, along - 1)
        room = water_level(np.bincount(cell), most)
        order = np.lexsort((sample_hash(table.photo, table.pixel), cell))
        sorted_cell = cell[order]
        first = np.searchsorted(sorted_cell, sorted_cell)
        rows = np.sort(order[np.arange(len(order)) - first < room])
        angles = (table.theta_h, table.theta_d, table.phi_d)
        return MeasuredPoints(
            Angles(*(a[rows].astype(np.float32) for a in angles)),
            table.rho[rows].astype(np.float32),
            table.photo[rows],
        )

    @staticmethod
    def from_rows(rows: NDArray[np.floating]) -> MeasuredPoints:
        """The inverse of ``rows``."""
        angles = Angles(*(rows[:, k].astype(np.float32) for k in range(3)))
        return MeasuredPoints(angles, rows[:, 3:6].astype(np.float32), rows[:, 6].astype(np.int16))

    def rows(self) -> NDArray[np.float32]:
        """(n, 7): θh, θd, φd in radians; ρ of R, G, B; the photo."""
        return np.column_stack([*self.angles, self.rho, self.photo]).astype(np.float32)
