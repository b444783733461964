"""The mean reflectance of each piece of the surface in each photo: the data that materials are
clustered by."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import Basis, mapping
from ..samples import SampleTable

Array = NDArray[np.float64]
COMPONENTS = 6  # of the BRDF basis
KNOTS = 10  # of a free curve over θh in addition, for lobes unlike those of the measured materials
NORMAL_ERROR = np.radians(2.0)  # of a scanned normal, typical; dense stereo has 1° (median) to 3.5°
# smallest ρ·cosMap of a sample; MERL's blackest paints have 0.002. Darker pixels come from surface
# that does not exist, or from shadows that the mesh does not cast
MIN_REFLECTANCE = 1e-3
ROWS_AT_ONCE = 1 << 18  # samples processed at once, to limit memory

# lightness and two opponent chromaticities of log RGB: errors of normals or exposure change only
# the lightness
OPPONENT = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3.0], [2.0], [6.0]])


@dataclass(frozen=True)
class Cells:
    """m cells; each is the mean over the pixels of one piece of the surface in one photo.

    piece, photo: (m,) int32; count: (m,) number of pixels; seen: (m, 3) mapped, centred reflectance
    (mapping of Nielsen et al. 2015, log units) as lightness and two chromaticities; rows: (m, k)
    rows of the basis and of the free curve; theta_h: (m,) radians; tilted: (2, m, k) rows with θh
    larger and smaller by NORMAL_ERROR; shift: (2, m) the change of the basis mean there; slant:
    (m,) tan θi.
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
        """Means over the samples of one photo; piece: (n,) the piece of each sample. Samples darker
        than MIN_REFLECTANCE are excluded."""
        light = table.rho.mean(axis=1) * mapping.cos_map(table.angles) > MIN_REFLECTANCE
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
        """Concatenate the cells of several photos."""
        joined = {}
        for f in fields(Cells):
            axis = 1 if f.name in ("tilted", "shift") else 0
            joined[f.name] = np.concatenate([getattr(part, f.name) for part in parts], axis=axis)
        return Cells(**joined)

    def select(self, which: NDArray) -> Cells:
        """The cells of a boolean mask or an index array."""
        selected = {}
        for f in fields(Cells):
            values = getattr(self, f.name)
            selected[f.name] = values[:, which] if f.name in ("tilted", "shift") else values[which]
        return Cells(**selected)

    def merged(self, group: NDArray[np.int32]) -> Cells:
        """Cells of larger pieces; group: (pieces,) the larger piece that contains each piece."""
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
    """(centre (n,), rows (n, k)): the components, then hat functions at equal steps of √θh, like
    the MERL grid."""
    centre, q = basis.rows(angles, COMPONENTS)
    at = np.sqrt(np.clip(angles.theta_h / (np.pi / 2), 0.0, 1.0)) * (KNOTS - 1)
    hats = np.maximum(1.0 - np.abs(at[:, None] - np.arange(KNOTS)), 0.0)
    return centre.astype(np.float64), np.concatenate([q, hats], axis=1)
