"""What one photo says of one piece of surface: the observations that tell materials apart."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import Basis, mapping
from ..samples import SampleTable

Array = NDArray[np.float64]
COMPONENTS = 6
KNOTS = 10  # of a free curve over θh beside the components: lobes that no measured material has
NORMAL_ERROR = np.radians(2.0)  # of a scanned normal, typical; dense stereo has 1° (median) to 3.5°
# ρ·cosMap: MERL's blackest paints have 0.002. Where a photo is darker the scan has surface that is
# not there, or shadow that its mesh does not cast
DARKEST = 1e-3
ROWS_AT_ONCE = 1 << 18

# lightness and two opponent chromaticities of log RGB: an error of normal or exposure moves only
# the first
OPPONENT = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3.0], [2.0], [6.0]])


@dataclass(frozen=True)
class Cells:
    """m means over the pixels of a piece of surface in a photo.

    piece, photo: (m,) int32; count: (m,) pixels; seen: (m, 3) mapped, centred reflectance
    (Nielsen's mapping, log units) as lightness and two chromaticities; rows: (m, k) of the basis
    and the free curve; theta_h: (m,) radians; tilted: (2, m, k) rows with θh larger and smaller by
    NORMAL_ERROR, and shift: (2, m) how the basis' mean moves with it; slant: (m,) tan θi.
    """

    piece: NDArray[np.int32]
    photo: NDArray[np.int32]
    count: Array
    seen: Array
    rows: Array
    theta_h: Array
    tilted: Array
    shift: Array
    slant: Array

    def __len__(self) -> int:
        return len(self.piece)

    @classmethod
    def of(cls, table: SampleTable, piece: NDArray[np.int32], photo: int, basis: Basis) -> Cells:
        """Means over samples of one photo that show the pieces (n,); black ones are left out."""
        light = table.rho.mean(axis=1) * mapping.cos_map(table.angles) > DARKEST
        table, piece = table.select(light), piece[light]
        which, inverse, count = np.unique(piece, return_inverse=True, return_counts=True)
        m, k = len(which), min(COMPONENTS, basis.count) + KNOTS
        inverse = inverse.ravel()
        sums = np.zeros((m, 3 + k))
        angle_sums = np.zeros((m, 4))
        for begin in range(0, len(table), ROWS_AT_ONCE):
            part = slice(begin, begin + ROWS_AT_ONCE)
            angles = Angles(*(a[part] for a in table.angles))
            centre, q = _rows(basis, angles)
            log = mapping.log_weighted(table.rho[part], mapping.cos_map(angles))
            values = np.concatenate([(log - centre[:, None]) @ OPPONENT.T, q], axis=1)
            plain = np.stack([*angles, np.arccos(np.clip(table.cos_i[part], 0, 1))], axis=1)
            rows = inverse[part]
            for column in range(values.shape[1]):
                sums[:, column] += np.bincount(rows, values[:, column], m)
            for column in range(4):
                angle_sums[:, column] += np.bincount(rows, plain[:, column], m)
        mean = sums / count[:, None]
        theta_h, theta_d, phi_d, theta_i = (angle_sums / count[:, None]).T
        here, _ = basis.rows(Angles(theta_h, theta_d, phi_d), 0)
        tilted, shift = [], []
        for step in (NORMAL_ERROR, -NORMAL_ERROR):
            moved = Angles(np.clip(np.abs(theta_h + step), 0, np.pi / 2), theta_d, phi_d)
            there, q = _rows(basis, moved)
            tilted.append(q)
            shift.append(there - here)
        return cls(
            which.astype(np.int32),
            np.full(m, photo, np.int32),
            count.astype(float),
            mean[:, :3],
            mean[:, 3:],
            theta_h,
            np.array(tilted, float),
            np.array(shift, float),
            np.tan(np.clip(theta_i, 0.0, 1.45)),
        )

    @staticmethod
    def join(parts: list[Cells]) -> Cells:
        """Cells of several photos, one after the other."""
        joined = {}
        for f in fields(Cells):
            axis = 1 if f.name in ("tilted", "shift") else 0
            joined[f.name] = np.concatenate([getattr(part, f.name) for part in parts], axis=axis)
        return Cells(**joined)

    def select(self, which: NDArray) -> Cells:
        """The rows of a boolean mask or an index array."""
        chosen = {}
        for f in fields(Cells):
            values = getattr(self, f.name)
            chosen[f.name] = values[:, which] if f.name in ("tilted", "shift") else values[which]
        return Cells(**chosen)

    def merged(self, group: NDArray[np.int32]) -> Cells:
        """Cells of larger pieces: ``group`` (pieces,) says which one each piece is part of."""
        photos = int(self.photo.max()) + 1 if len(self) else 1
        key = group[self.piece].astype(np.int64) * photos + self.photo
        which, inverse = np.unique(key, return_inverse=True)
        inverse = inverse.ravel()
        total: Array = np.bincount(inverse, self.count, len(which)).astype(np.float64)

        def mean(values: Array) -> Array:
            flat = values.reshape(len(self), -1)
            columns = [
                np.bincount(inverse, self.count * flat[:, c], len(which)) / total
                for c in range(flat.shape[1])
            ]
            return np.stack(columns, axis=1).reshape(len(which), *values.shape[1:])

        return Cells(
            (which // photos).astype(np.int32),
            (which % photos).astype(np.int32),
            total,
            mean(self.seen),
            mean(self.rows),
            mean(self.theta_h),
            np.stack([mean(t) for t in self.tilted]),
            np.stack([mean(s) for s in self.shift]),
            mean(self.slant),
        )


def _rows(basis: Basis, angles: Angles) -> tuple[Array, Array]:
    """(centre (n,), rows (n, k)): components, then hats over √θh, where MERL's grid is even too."""
    centre, q = basis.rows(angles, COMPONENTS)
    at = np.sqrt(np.clip(angles.theta_h / (np.pi / 2), 0.0, 1.0)) * (KNOTS - 1)
    hats = np.maximum(1.0 - np.abs(at[:, None] - np.arange(KNOTS)), 0.0)
    return centre.astype(np.float64), np.concatenate([q, hats], axis=1)
