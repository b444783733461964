"""Materials proposed from the photos: parts of the surface that reflect alike under all lights.

The surface is divided into patches. The patches are clustered into materials (proposal_model.py),
by splitting one material into two at a time, as long as the split is significant
(proposal_split.py). The labels of the faces follow from those of the patches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from ..errors import FitError
from ..scan import Mesh
from .proposal_cells import Cells
from .proposal_model import Mixture, cell_likelihood, fit_mixture
from .proposal_split import MIN_PATCHES, Split, judge, lamps_of
from .proposal_surface import Surface, fill_hidden, smooth_labels, spread, without_islands

Array = NDArray[np.float64]

MOST_MATERIALS = 8
MAX_CELLS = 40_000  # patches × photos
DECISIVE_RATIO = 6.0  # log likelihood ratio: from it on, a patch ignores its neighbours
MIN_ISLAND = 0.002  # share of the surface area


@dataclass(frozen=True)
class Proposal:
    """Proposed materials of f faces. labels: (f,) int32 0…count−1, the largest material first;
    confidence: (f,) float32 0…1, 0 where no photo shows the face lit; count: number of materials;
    splits: all splits that were tried, in order."""

    labels: NDArray[np.int32]
    confidence: NDArray[np.float32]
    count: int
    splits: tuple[Split, ...]


def propose_materials(
    cells: Cells,
    mesh: Mesh,
    count: int | None = None,
    lamps: Sequence[int] | None = None,
) -> Proposal:
    """Divide the faces of a mesh among materials.

    cells: one piece for each face (Cells.of with face numbers), of all photos. count: number of
    materials; None: as many as differ significantly, 1 without a significant difference. lamps:
    the index of the light of each photo (default: each photo has its own).
    Raises FitError if the photos show too little of the surface.
    """
    surface = Surface.of(mesh)
    photos = len(np.unique(cells.photo))
    seen = np.zeros(len(mesh.faces), bool)
    seen[cells.piece] = True
    if not seen.any():
        raise FitError(
            "no photo shows a lit face; expected photos that show the mesh; check camera poses and "
            "lights"
        )
    if count == 1:
        return Proposal(np.zeros(len(seen), np.int32), seen.astype(np.float32), 1, ())
    wanted = int(np.clip(MAX_CELLS / max(photos, 1), 300, 3000))
    patch = surface.patches(min(wanted, max(len(mesh.faces) // 8, 1)))
    broad = cells.merged(patch)
    kept, number = np.unique(broad.piece, return_inverse=True)
    if len(kept) < MIN_PATCHES:
        raise FitError(
            f"the photos show only {len(kept)} lit patches of the surface; expected at least "
            f"{MIN_PATCHES} to separate materials; take photos that show more of it"
        )
    dense = np.full(int(patch.max()) + 1, -1)
    dense[kept] = np.arange(len(kept))
    joined = surface.joined(patch)[kept][:, kept]
    broad = Cells(number.ravel().astype(np.int32), *_rest(broad))
    mixture, splits = _divide(broad, joined, count, *lamps_of(broad, lamps))
    labels, confidence = _onto_faces(
        cells, mixture, surface, seen, dense[patch], random_walk_probabilities(mixture, joined)
    )
    return _largest_first(labels, confidence, surface, splits)


def _rest(cells: Cells) -> tuple:
    """All fields of Cells except ``piece``, in order."""
    return (
        cells.photo, cells.count, cells.seen, cells.rows, cells.theta_h, cells.tilted,
        cells.shift, cells.slant,
    )  # fmt: skip


def _divide(
    cells: Cells, joined: csr_array, count: int | None, lamp: NDArray[np.intp], one_light: bool
) -> tuple[Mixture, tuple[Split, ...]]:
    """Split materials, beginning with one; returns the final mixture and all splits tried."""
    pieces = int(cells.piece.max()) + 1
    mixture = fit_mixture(cells, np.ones((pieces, 1)))
    splits: list[Split] = []
    finished: set[int] = set()
    most = MOST_MATERIALS if count is None else count
    while len(mixture.share) < most:
        tried = []
        for material in range(len(mixture.share)):
            if count is None and material in finished:
                continue
            halves = _halves(cells, joined, mixture.labels == material)
            if halves is None:
                finished.add(material)
                continue
            tried.append((halves[1], material, halves[0]))
        if not tried:
            break
        # the split with the largest gain in log likelihood
        _, material, second = max(tried, key=lambda t: t[0])
        membership = np.zeros((pieces, len(mixture.share) + 1))
        membership[np.arange(pieces), mixture.labels] = 1.0
        membership[second, material] = 0.0
        membership[second, -1] = 1.0
        new = fit_mixture(cells, membership, joined)
        split = judge(cells, new, material, len(new.share) - 1, lamp, joined, one_light)
        splits.append(split)
        if count is None and not split.real:
            finished.add(material)
            if len(finished) >= len(mixture.share):
                break
            continue
        mixture = new
        finished.clear()
    return mixture, tuple(splits)


def _halves(
    cells: Cells, joined: csr_array, mine: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], float] | None:
    """(pieces of the second half, gain in log likelihood) of the best split of the pieces ``mine``
    (pieces,) in two; None if there is none."""
    members = np.flatnonzero(mine)
    if len(members) < MIN_PATCHES:
        return None
    dense = np.full(len(mine), -1)
    dense[members] = np.arange(len(members))
    part = cells.select(mine[cells.piece])
    part = Cells(dense[part.piece].astype(np.int32), *_rest(part))
    near = joined[members][:, members]
    one = fit_mixture(part, np.ones((len(members), 1)))
    best: Mixture | None = None
    for start in _starts(part, one):
        found = fit_mixture(part, np.eye(2)[start], near)
        if min(np.bincount(found.labels, minlength=2)) == 0:
            continue
        if best is None or found.total > best.total:
            best = found
    if best is None:
        return None
    return members[best.labels == 1], best.total - one.total


def _starts(cells: Cells, one: Mixture) -> list[NDArray[np.intp]]:
    """Initial splits of the pieces, each (pieces,) 0 or 1: by the residuals of a single material
    in colour, in lightness outside highlights and in them, and by all of these (k-means)."""
    pieces = int(cells.piece.max()) + 1
    residual = cells.seen - cells.rows @ one.coefficients[0].T
    matte, shiny = cells.theta_h > np.radians(35), cells.theta_h < np.radians(22)
    features = [_mean_of(cells, residual[:, 1], None), _mean_of(cells, residual[:, 2], None)]
    features += [_mean_of(cells, residual[:, 0], matte), _mean_of(cells, residual[:, 0], shiny)]
    features.append(features[3] - features[2])
    table = np.stack(features, axis=1)
    width = 1.483 * np.median(np.abs(table - np.median(table, axis=0)), axis=0)
    table = np.clip(table / np.maximum(width, 1e-6), -6, 6)
    starts = [_two_clusters(column)[0] for column in table.T]
    rng = np.random.default_rng(0)
    for _ in range(2):
        _, labels = kmeans2(table[:, :4], 2, minit="++", seed=rng)
        starts.append(labels)
    return [start.astype(np.intp) for start in starts if 0 < start.sum() < pieces]


def _mean_of(cells: Cells, values: Array, where: NDArray[np.bool_] | None) -> Array:
    """(pieces,) mean of values (m,) over the cells ``where`` of each piece, 0 without any."""
    weight = np.ones(len(cells)) if where is None else where.astype(float)
    pieces = int(cells.piece.max()) + 1
    total = np.bincount(cells.piece, weight, pieces)
    return np.bincount(cells.piece, weight * values, pieces) / np.maximum(total, 1e-9)


def _two_clusters(values: Array, weight: Array | None = None) -> tuple[NDArray[np.bool_], float]:
    """(True for values in the upper cluster, share of the variance that the two clusters explain),
    by the optimal threshold (Otsu 1979)."""
    w = np.ones(len(values)) if weight is None else weight
    order = np.argsort(values, kind="stable")
    v, w = values[order], w[order]
    below, sums = np.cumsum(w), np.cumsum(w * v)
    mean, total = sums[-1] / below[-1], below[-1]
    variance = float((w * (v - mean) ** 2).sum())
    under, over = below[:-1], np.maximum(total - below[:-1], 1e-12)
    between = under * (sums[:-1] / under - mean) ** 2
    between += over * ((sums[-1] - sums[:-1]) / over - mean) ** 2
    cut = int(np.argmax(between))
    upper = np.zeros(len(values), bool)
    upper[order[cut + 1 :]] = True
    return upper, float(between[cut] / max(variance, 1e-12))


def random_walk_probabilities(mixture: Mixture, joined: csr_array) -> Array:
    """(pieces, K) probability of each material, where pieces with little evidence follow their
    neighbours: random-walk segmentation (Grady 2006), which stops at pieces with clear evidence."""
    pieces = len(mixture.likelihood)
    value = mixture.likelihood + np.log(mixture.share)
    value = value - np.logaddexp.reduce(value, axis=1, keepdims=True)
    own = np.exp(value)
    best = np.sort(mixture.likelihood, axis=1)
    margin = best[:, -1] - best[:, -2] if best.shape[1] > 1 else np.ones(pieces)
    stop = np.clip(margin / DECISIVE_RATIO, 1e-4, 1.0) ** 2
    degree = np.maximum(np.asarray(joined.sum(axis=1)).ravel(), 1e-9)
    shares = diags_array(1.0 / degree) @ joined
    system = diags_array(stop + 0.2) - 0.2 * shares
    solved = splu(csc_array(system)).solve(stop[:, None] * own)
    return np.asarray(np.clip(solved, 0.0, 1.0))


def _onto_faces(
    cells: Cells,
    mixture: Mixture,
    surface: Surface,
    seen: NDArray[np.bool_],
    patch: NDArray,
    regional: Array,
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """(labels (f,), confidence (f,)) of the faces, from their own cells and those around them."""
    faces, count = len(seen), len(mixture.share)
    each = np.empty((len(cells), count))
    step = 1 << 17
    for begin in range(0, len(cells), step):
        part = slice(begin, begin + step)
        each[part] = cell_likelihood(cells.select(np.arange(len(cells))[part]), mixture)
    own: Array = np.stack(
        [np.bincount(cells.piece, each[:, c], faces) for c in range(count)], axis=1
    )
    own -= own.mean(axis=1, keepdims=True)
    per_patch = faces / max(int(patch.max()) + 1, 1)
    rounds = int(np.clip(round(np.sqrt(per_patch) / 4), 1, 6))
    around = spread(own, surface.neighbours, rounds)
    likely = 2.0 * around
    # the prior from the patch and its neighbours decides where the face has little evidence
    likely[patch >= 0] += np.log(0.02 + regional[patch[patch >= 0]])
    labels = smooth_labels(likely, surface.neighbours, 4.0)
    fill_hidden(labels, seen, surface)
    labels = without_islands(labels, surface, MIN_ISLAND)
    top = np.exp(likely - np.logaddexp.reduce(likely, axis=1, keepdims=True))
    confidence = top[np.arange(faces), labels]
    confidence = np.clip((confidence * count - 1) / (count - 1), 0, 1) if count > 1 else seen * 1.0
    return labels, np.where(seen, confidence, 0.0).astype(np.float32)


def _largest_first(
    labels: NDArray[np.int32],
    confidence: NDArray[np.float32],
    surface: Surface,
    splits: tuple[Split, ...],
) -> Proposal:
    """The proposal with its materials numbered by decreasing area, without gaps."""
    used, labels = np.unique(labels, return_inverse=True)
    area = np.bincount(labels.ravel(), surface.area, len(used))
    rank = np.empty(len(used), np.int32)
    rank[np.argsort(-area, kind="stable")] = np.arange(len(used))
    return Proposal(rank[labels.ravel()], confidence, len(used), splits)
