"""Whether a material that was divided in two really is two."""

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

FEWEST_PATCHES = 20
# Two are two where their patches' places between the two models fall into two heaps: halving one
# normal heap explains 64 % of the places' variance, an even spread 75 %
TWO_HEAPS = 0.82
AGREEMENT = 0.75  # of patches: what one light shows is what all others show
SMALLEST_SHARE = 0.01  # of the patches
COHERENT = 0.5  # of a patch's borders lie within its own part; in a mixed strip a third
WITNESSED = 0.05  # of a part's patches are reached by several lights
BLACK = -1.8  # log: a sixth as light
CLEAR = 2.0  # standard errors between the two, for a patch to count


@dataclass(frozen=True)
class Split:
    """Why a material was, or was not, divided. heaps: variance explained by two heaps; agreement:
    of each light with all others; informative: share of patches that can tell; smaller: share of
    the patches in the smaller part; lightness, chroma: RMS difference, log units; witnessed: share
    of the patches that several lights reach, in the part where it is less; coherence: share of
    their borders that lie within the part, where it is less; shadow: True
    where the new part is black and all photos have one light: shadow and paint look the same."""

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
        """True for colours so unlike that no light between neighbours explains them."""
        return self.heaps > 0.9 and self.chroma > 0.5

    @property
    def real(self) -> bool:
        """True for two materials."""
        return (
            self.heaps > TWO_HEAPS
            and self.agreement > AGREEMENT
            and self.smaller > SMALLEST_SHARE
            and self.coherence > COHERENT
            and (self.witnessed > WITNESSED or self.plain)
            and not self.shadow
            and (self.lightness > 2 * LIGHTNESS or self.chroma > 2 * CHROMA)
        )


def lamps_of(cells: Cells, lamps: Sequence[int] | None) -> tuple[NDArray[np.intp], bool]:
    """((photos,) which light each photo has, counted from 0; whether all have one: then the
    photos' own numbers stand for lights). A shadow that the mesh does not explain is in all photos
    of its light, and looks like paint: photos of one light cannot vouch for each other."""
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
    """Materials ``one`` and ``other`` of a mixture: one or two? lamp: (photos,) of lamps_of;
    one_light: True where all photos have the same light."""
    number = np.flatnonzero(np.isin(mixture.labels, (one, other)))
    dense = np.full(len(mixture.labels), -1)
    dense[number] = np.arange(len(number))
    part = cells.select(dense[cells.piece] >= 0)
    piece = dense[part.piece]
    labels = mixture.labels[number] == other
    apart = mixture.coefficients[other] - mixture.coefficients[one]
    step = part.rows @ apart.T
    place, precision = _places(part, piece, mixture, one, other, step)
    clear = precision > CLEAR**2
    if clear.sum() < FEWEST_PATCHES or labels[clear].all() or not labels[clear].any():
        return Split(0.0, 0.0, float(clear.mean()), 0.0, 0.0, 0.0, 0.0, 0.0, False)
    # both heaps count alike, however many patches each has
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
        shadow=one_light and float(np.mean(step[:, 0])) / 3**0.5 < BLACK,
    )


def _places(
    part: Cells, piece: NDArray[np.intp], mixture: Mixture, one: int, other: int, step: Array
) -> tuple[Array, Array]:
    """((pieces,) where each piece lies between the models, 0 at the one and 1 at the other, and
    (pieces,) how well that is known, 1 / variance)."""
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
    """(share of pieces that a light calls what all other lights call them, in whichever material
    it is less; (pieces,) True where several lights reach)."""
    lamps, count = int(lamp.max()) + 1, int(piece.max()) + 1
    each = np.bincount(piece * lamps + lamp, ratio, count * lamps).reshape(count, lamps)
    reached = np.bincount(piece * lamps + lamp, minlength=count * lamps).reshape(count, lamps) > 0
    rest = each.sum(axis=1, keepdims=True) - each
    several = reached.sum(axis=1) > 1
    clearly = reached & several[:, None] & (np.abs(each) > 1.0) & (np.abs(rest) > 1.0)
    found = 1.0
    for side in (True, False):
        for asked, answer in ((rest, each), (each, rest)):
            where = clearly & ((asked > 0) == side)
            found = min(found, _share((answer > 0) == side, where))
    return found, several


def _coherence(joined: csr_array, part: NDArray[np.bool_]) -> float:
    borders = joined[np.flatnonzero(part)]
    return float(borders[:, np.flatnonzero(part)].sum() / max(float(borders.sum()), 1e-9))


def _share(where: Labels, among: Labels) -> float:
    return float(where[among].mean()) if among.any() else 0.0


def _explained(values: Array, upper: NDArray[np.bool_], weight: Array) -> float:
    """Share of the variance of values that lies between the two groups."""
    mean = np.average(values, weights=weight)
    inner = 0.0
    for side in (upper, ~upper):
        inner += float(
            (
                weight[side] * (values[side] - np.average(values[side], weights=weight[side])) ** 2
            ).sum()
        )
    return 1.0 - inner / max(float((weight * (values - mean) ** 2).sum()), 1e-12)
