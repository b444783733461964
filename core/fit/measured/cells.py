"""All samples gathered in cells of angle space: what the BRDF is solved from.

Off-specular pixels outnumber those of the highlight a thousand to one; cells make them count alike,
and the solver's cost does not grow with the photos' size. Within a cell RADIANCE is averaged: its
mean is that of the blurred BRDF, whatever the normals' errors; the mean of logarithms is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, cosines
from ...samples import SampleTable

THETA_D = 2.0  # degrees
PHI_D = ((1.0, 60.0), (4.0, 20.0), (91.0, 6.0))  # width for θh below, degrees
NARROWEST, GROWTH, WIDEST = 0.25, 0.12, 2.0  # of θh, degrees: the first, a degree further, the last
MOST = 60_000  # cells; beyond, they are made wider


@dataclass(frozen=True)
class AngleCells:
    """m cells with samples, each of one photo.

    photo: (m,) int16. count: (m,) samples. angles: their mean, φd on
    [0, 2π). reflected: (m, 3) mean of L/E (= ρ·cos θi blurred by
    the normals' errors), at the cosine of the mean angles. normal_error:
    (m,) radians, RMS error of the normals along each tangent, where it is known from a refinement.
    """

    photo: NDArray[np.int16]
    count: NDArray[np.int64]
    angles: Angles
    reflected: NDArray[np.float64]
    normal_error: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.photo)

    def select(self, which: NDArray) -> AngleCells:
        """The rows of a boolean mask or an index array."""
        return AngleCells(
            self.photo[which],
            self.count[which],
            Angles(*(a[which] for a in self.angles)),
            self.reflected[which],
            self.normal_error[which],
        )


def gather(
    table: SampleTable, normal_error: NDArray[np.floating] | float, wider: float = 1.0
) -> AngleCells:
    """Cells of a table; normal_error: (n,) radians of each sample, or one for all."""
    phi = unfolded_phi_d(table)
    key = _keys(table, phi, wider)
    _, where, count = np.unique(key, return_inverse=True, return_counts=True)
    m = len(count)
    if m > MOST:
        return gather(table, normal_error, wider * 1.3)
    where = where.ravel()

    def mean(values: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.bincount(where, values, m) / count

    phi_d = np.mod(np.arctan2(mean(np.sin(phi)), mean(np.cos(phi))), 2 * np.pi)
    angles = Angles(mean(table.theta_h), mean(table.theta_d), phi_d)
    # mean angles stand for the cell: the cosine's own change within it is taken out
    level = cosines(*angles)[0] / mean(table.cos_i)
    light = table.radiance / table.irradiance
    reflected = np.stack([mean(light[:, c]) * level for c in range(light.shape[1])], axis=1)
    first = np.zeros(m, np.intp)
    first[where] = np.arange(len(where))
    if np.ndim(normal_error):
        error = np.sqrt(mean(np.square(normal_error)))
    else:
        error = np.full(m, float(normal_error))
    return AngleCells(table.photo[first], count, angles, reflected, error)


def unfolded_phi_d(table: SampleTable) -> NDArray[np.float64]:
    """(n,) φd on [0, 2π): samples' are folded by reciprocity, which exchanges light and view, but
    a cell's cosine must be the light's."""
    one, other = cosines(*table.angles)
    exchanged = np.abs(table.cos_i - other) < np.abs(table.cos_i - one)
    return np.asarray(table.phi_d.astype(np.float64) + np.pi * exchanged)


def theta_h_edges(wider: float = 1.0) -> NDArray[np.float64]:
    """Radians: narrow where lobes are, two degrees wide elsewhere."""
    edges = [0.0]
    while edges[-1] < 90.0:
        edges.append(edges[-1] + wider * min(WIDEST, NARROWEST + GROWTH * edges[-1]))
    return np.radians(edges)


def _keys(table: SampleTable, phi_d: NDArray[np.float64], wider: float) -> NDArray[np.int64]:
    ih = np.searchsorted(theta_h_edges(wider), table.theta_h, side="right").astype(np.int64)
    i_d = (np.degrees(table.theta_d) / (wider * THETA_D)).astype(np.int64)
    width = np.full(len(table), PHI_D[-1][1])
    for below, degrees in reversed(PHI_D[:-1]):
        width[table.theta_h < np.radians(below)] = degrees
    ip = (np.degrees(phi_d) / (wider * width)).astype(np.int64)
    return ((table.photo.astype(np.int64) * 512 + ih) * 64 + i_d) * 64 + ip
