"""All samples averaged in cells of angle space, from which the BRDF is solved.

Off-specular pixels outnumber those of the highlight a thousand to one. Averaging them in cells
gives both a similar weight, and the solver's cost does not grow with the resolution of the photos.
Within a cell the RADIANCE is averaged: its mean is that of the BRDF blurred by the normals' errors.
The mean of the logarithm does not have this property.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles, cosines
from ...noise.pixel_error import bright_parts
from ...samples import SampleTable

THETA_D_WIDTH = 2.0  # degrees
# degrees: (upper limit of θh, width of a cell in φd below it)
PHI_D_WIDTHS = ((1.0, 60.0), (4.0, 20.0), (91.0, 6.0))
# width of a cell in θh, degrees: the first, its increase per degree of θh, the largest
MIN_THETA_H_WIDTH, WIDTH_GROWTH, MAX_THETA_H_WIDTH = 0.25, 0.12, 2.0
MAX_CELLS = 60_000  # where a table has more, the cells are made wider


@dataclass(frozen=True)
class AngleCells:
    """m cells with samples, each of one photo.

    photo: (m,) int16. count: (m,) number of samples. angles: their mean angles, radians, φd on [0,
    2π). reflected: (m, 3) mean of L/E (= ρ·cos θi, blurred by the normals' errors), scaled to the
    cosine at the mean angles. noise: (m, 3) variance of L/E of one sample by the photo's noise,
    on the same scale. bright: (m,) L/E of the bright parts of the photo. normal_error: (m,)
    radians, RMS error of the normals along each tangent. clipped: (m, 3) fraction of the samples
    that are clipped: they count with the level at which the photo is clipped. white: (m, 3) this
    level, on the scale of ``reflected``; infinite in photos without clipped samples.
    """

    photo: NDArray[np.int16]
    count: NDArray[np.int64]
    angles: Angles
    reflected: NDArray[np.float64]
    noise: NDArray[np.float64]
    bright: NDArray[np.float64]
    normal_error: NDArray[np.float64]
    clipped: NDArray[np.float64]
    white: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.photo)

    def select(self, which: NDArray) -> AngleCells:
        """The rows of a boolean mask or an index array."""
        return AngleCells(
            self.photo[which],
            self.count[which],
            Angles(*(a[which] for a in self.angles)),
            self.reflected[which],
            self.noise[which],
            self.bright[which],
            self.normal_error[which],
            self.clipped[which],
            self.white[which],
        )


def gather(
    table: SampleTable,
    normal_error: NDArray[np.floating] | float,
    width_factor: float = 1.0,
    clipped: NDArray[np.bool_] | None = None,
) -> AngleCells:
    """The cells of a table.

    normal_error: (n,) radians along each tangent, of each sample, or one number for all.
    width_factor: factor on the width of the cells; it grows until there are at most MAX_CELLS.
    clipped: (n, 3) whether the radiance is a lower limit; None where no sample is clipped.
    """
    phi = unfolded_phi_d(table)
    key = _keys(table, phi, width_factor)
    _, where, count = np.unique(key, return_inverse=True, return_counts=True)
    m = len(count)
    if m > MAX_CELLS:
        return gather(table, normal_error, width_factor * 1.3, clipped)
    where = where.ravel()
    # measured and clipped samples of a cell may represent different numbers of pixels
    total = np.bincount(where, table.weight, m)

    def mean(values: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.bincount(where, values * table.weight, m) / total

    phi_d = np.mod(np.arctan2(mean(np.sin(phi)), mean(np.cos(phi))), 2 * np.pi)
    angles = Angles(mean(table.theta_h), mean(table.theta_d), phi_d)
    # a cell is represented by its mean angles: remove the variation of cos θi within it
    level = cosines(*angles)[0] / mean(table.cos_i)
    light = table.radiance / table.irradiance
    reflected = np.stack([mean(light[:, c]) * level for c in range(3)], axis=1)
    spread = table.variance / table.irradiance**2
    noise = np.stack([mean(spread[:, c]) * level**2 for c in range(3)], axis=1)
    first = np.zeros(m, np.intp)
    first[where] = np.arange(len(where))
    if np.ndim(normal_error):
        error = np.sqrt(mean(np.square(normal_error)))
    else:
        error = np.full(m, float(normal_error))
    photo = table.photo[first]
    bright = bright_parts(light.mean(axis=1), table.photo)[photo]
    share, white = np.zeros((m, 3)), np.full((m, 3), np.inf)
    if clipped is not None:
        share = np.stack([mean(clipped[:, c].astype(float)) for c in range(3)], axis=1)
        part = np.stack([mean(clipped[:, c] * light[:, c]) * level for c in range(3)], axis=1)
        white = _white(part, share, photo)
    return AngleCells(photo, count, angles, reflected, noise, bright, error, share, white)


def _white(
    part: NDArray[np.float64], share: NDArray[np.float64], photo: NDArray[np.int16]
) -> NDArray[np.float64]:
    """(m, 3) the level at which cells are clipped, from the part of their mean that clipped samples
    contribute and the fraction of these, both (m, 3). A cell without clipped samples has the mean
    of its photo."""
    photos = int(photo.max()) + 1
    out = np.full_like(part, np.inf)
    for c in range(3):
        some = share[:, c] > 0
        out[some, c] = part[some, c] / share[some, c]
        count = np.bincount(photo[some], minlength=photos)
        mean = np.full(photos, np.inf)
        np.divide(np.bincount(photo[some], out[some, c], photos), count, out=mean, where=count > 0)
        out[~some, c] = mean[photo[~some]]
    return out


def unfolded_phi_d(table: SampleTable) -> NDArray[np.float64]:
    """(n,) φd on [0, 2π), radians. The samples' φd is folded by reciprocity, which exchanges light
    and view, but a cell's cosine must be that of the light."""
    cos_light, cos_view = cosines(*table.angles)
    exchanged = np.abs(table.cos_i - cos_view) < np.abs(table.cos_i - cos_light)
    return np.asarray(table.phi_d.astype(np.float64) + np.pi * exchanged)


def theta_h_edges(width_factor: float = 1.0) -> NDArray[np.float64]:
    """Edges of the cells in θh, radians: narrow where lobes are, 2° × ``width_factor``
    elsewhere."""
    edges = [0.0]
    while edges[-1] < 90.0:
        edges.append(
            edges[-1]
            + width_factor * min(MAX_THETA_H_WIDTH, MIN_THETA_H_WIDTH + WIDTH_GROWTH * edges[-1])
        )
    return np.radians(edges)


def _keys(table: SampleTable, phi_d: NDArray[np.float64], width_factor: float) -> NDArray[np.int64]:
    """(n,) number of the cell (photo, θh, θd, φd) of each sample."""
    ih = np.searchsorted(theta_h_edges(width_factor), table.theta_h, side="right").astype(np.int64)
    i_d = (np.degrees(table.theta_d) / (width_factor * THETA_D_WIDTH)).astype(np.int64)
    width = np.full(len(table), PHI_D_WIDTHS[-1][1])
    for below, degrees in reversed(PHI_D_WIDTHS[:-1]):
        width[table.theta_h < np.radians(below)] = degrees
    ip = (np.degrees(phi_d) / (width_factor * width)).astype(np.int64)
    return ((table.photo.astype(np.int64) * 512 + ih) * 64 + i_d) * 64 + ip
