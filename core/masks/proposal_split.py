"""Test whether a material that was split in two really is two materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from .proposal_cells import Cells
from .proposal_model import CHROMA, LIGHTNESS, Mixture, cell_likelihood, errors

Array = NDArray[np.float64]
Labels = NDArray[np.bool_]

MIN_PATCHES = 20
# The patches' positions between the two models must form two clusters. Two halves of one normal
# distribution explain 64 % of the variance of the positions, two halves of a uniform one 75 %
MIN_EXPLAINED = 0.82
MIN_AGREEMENT = 0.75  # share of patches on which one light agrees with all others
MIN_SHARE = 0.01  # of the patches
MIN_COHERENCE = 0.5  # share of borders within the own part; in a mixed strip it is a third
MIN_WITNESSED = 0.05  # share of the patches of a part that several lights reach
SHADOW_LIGHTNESS = -1.8  # log ratio: a sixth of the reflectance may be a shadow
MIN_SEPARATION = 2.0  # standard errors between the two models, for a patch to be informative


@dataclass(frozen=True)
class Split:
    """The statistics by which a split is accepted or rejected.

    heaps: share of the variance that two clusters explain; agreement: of each light with all
    others; informative: share of the patches for which the two models differ significantly;
    smaller: share of the patches in the smaller part; lightness, chroma: RMS difference, log units;
    witnessed: share of the patches that several lights reach, minimum of both parts; coherence:
    share of the patches' borders within their own part, minimum of both parts; shadow: True if the
    new part is black and all photos have one light, so that it may be a shadow instead of paint.
    """

    heaps: float
    agreement: float
    informative: float
    smaller: float
    lightness: float
    chroma: float
    witnessed: float
    coherence: float
    shadow: bool

    @property
    def plain(self) -> bool:
        """True for colours so different that interreflections cannot explain them."""
        return self.heaps > 0.9 and self.chroma > 0.5

    @property
    def real(self) -> bool:
        """True if the two parts are different materials."""
        return (
            self.heaps > MIN_EXPLAINED
            and self.agreement > MIN_AGREEMENT
            and self.smaller > MIN_SHARE
            and self.coherence > MIN_COHERENCE
            and (self.witnessed > MIN_WITNESSED or self.plain)
            and not self.shadow
            and (self.lightness > 2 * LIGHTNESS or self.chroma > 2 * CHROMA)
        )


def lamps_of(cells: Cells, lamps: Sequence[int] | None) -> tuple[NDArray[np.intp], bool]:
    """((photos,) index of the light of each photo; True if all photos have the same light, in which
    case the indices are those of the photos). A shadow that the mesh does not cast appears in all
    photos of its light and looks like paint, so photos with the same light are no independent
    evidence."""
    photos = int(cells.photo.max()) + 1
    own = np.arange(photos)
    if lamps is None:
        return own, False
    lamp = np.asarray(lamps, np.intp)[:photos]
    single = len(np.unique(lamp[np.unique(cells.photo)])) < 2
    return (own if single else lamp), single


def judge(
    cells: Cells,
    mixture: Mixture,
    one: int,
    other: int,
    lamp: NDArray[np.intp],
    joined: csr_array,
    one_light: bool,
) -> Split:
    """Compute the statistics of the split into the materials ``one`` and ``other`` of a mixture.
    lamp, one_light: from lamps_of; joined: (pieces, pieces) adjacency."""
    members = np.flatnonzero(np.isin(mixture.labels, (one, other)))
    dense = np.full(len(mixture.labels), -1)
    dense[members] = np.arange(len(members))
    part = cells.select(dense[cells.piece] >= 0)
    piece = dense[part.piece]
    labels = mixture.labels[members] == other
    apart = mixture.coefficients[other] - mixture.coefficients[one]
    step = part.rows @ apart.T
    place, precision = _places(part, piece, mixture, one, other, step)
    clear = precision > MIN_SEPARATION**2
    if clear.sum() < MIN_PATCHES or labels[clear].all() or not labels[clear].any():
        return Split(0.0, 0.0, float(clear.mean()), 0.0, 0.0, 0.0, 0.0, 0.0, False)
    # both clusters have the same total weight, whatever their numbers of patches
    share = float(labels[clear].mean())
    weight = np.where(labels[clear], 0.5 / share, 0.5 / (1.0 - share))
    likely = cell_likelihood(part, mixture)
    agreement, witnessed = _agreement(piece, lamp[part.photo], likely[:, other] - likely[:, one])
    size = np.sqrt(np.mean(step**2, axis=0))
    return Split(
        heaps=_explained(place[clear], labels[clear], weight),
        agreement=agreement,
        informative=float(clear.mean()),
        smaller=min(share, 1.0 - share),
        lightness=float(size[0] / 3**0.5),
        chroma=float(np.hypot(size[1], size[2])),
        witnessed=min(_share(witnessed, labels), _share(witnessed, ~labels)),
        coherence=min(_coherence(joined, mixture.labels == m) for m in (one, other)),
        shadow=one_light and float(np.mean(step[:, 0])) / 3**0.5 < SHADOW_LIGHTNESS,
    )


def _places(
    part: Cells, piece: NDArray[np.intp], mixture: Mixture, one: int, other: int, step: Array
) -> tuple[Array, Array]:
    """((pieces,) position of each piece between the models, 0 for ``one`` and 1 for ``other``;
    (pieces,) its precision, 1 / variance)."""
    beyond = part.seen - part.rows @ mixture.coefficients[one].T
    width = 0.5 * sum(errors(part, mixture.coefficients[m]) for m in (one, other))
    own = np.array([3**0.5 * LIGHTNESS, CHROMA, CHROMA]) * mixture.scale[[0, 1, 1]]
    width = np.maximum(width, own)
    nearest = np.clip(beyond / np.where(step == 0, 1.0, step), 0.0, 1.0) * step
    weight = 1.0 / (1.0 + ((beyond - nearest) / width) ** 2 / 4.0) / width**2
    count = int(piece.max()) + 1
    precision = np.bincount(piece, (weight * step**2).sum(axis=1), count)
    place = np.bincount(piece, (weight * step * beyond).sum(axis=1), count)
    place = np.clip(place / np.maximum(precision, 1e-9), -1.0, 2.0)
    return np.asarray(place, np.float64), np.asarray(precision, np.float64)


def _agreement(
    piece: NDArray[np.intp], lamp: NDArray[np.intp], ratio: Array
) -> tuple[float, Labels]:
    """(share of pieces that one light assigns as all other lights do, minimum over both materials;
    (pieces,) True where several lights reach). ratio: (m,) log likelihood ratio of each cell."""
    lamps, count = int(lamp.max()) + 1, int(piece.max()) + 1
    each = np.bincount(piece * lamps + lamp, ratio, count * lamps).reshape(count, lamps)
    reached = np.bincount(piece * lamps + lamp, minlength=count * lamps).reshape(count, lamps) > 0
    rest = each.sum(axis=1, keepdims=True) - each
    several = reached.sum(axis=1) > 1
    clearly = reached & several[:, None] & (np.abs(each) > 1.0) & (np.abs(rest) > 1.0)
    found = 1.0
    for side in (True, False):
        for given, compared in ((rest, each), (each, rest)):
            where = clearly & ((given > 0) == side)
            found = min(found, _share((compared > 0) == side, where))
    return found, several


def _coherence(joined: csr_array, part: NDArray[np.bool_]) -> float:
    """Share of the borders of the pieces of a part that lie within the part."""
    borders = joined[np.flatnonzero(part)]
    return float(borders[:, np.flatnonzero(part)].sum() / max(float(borders.sum()), 1e-9))


def _share(where: Labels, among: Labels) -> float:
    """Share of True in ``where`` over the elements ``among``; 0 without any."""
    return float(where[among].mean()) if among.any() else 0.0


def _explained(values: Array, upper: NDArray[np.bool_], weight: Array) -> float:
    """Share of the weighted variance of values (n,) that lies between the two groups."""
    mean = np.average(values, weights=weight)
    inner = 0.0
    for side in (upper, ~upper):
        inner += float(
            (
                weight[side] * (values[side] - np.average(values[side], weights=weight[side])) ** 2
            ).sum()
        )
    return 1.0 - inner / max(float((weight * (values - mean) ** 2).sum()), 1e-12)
