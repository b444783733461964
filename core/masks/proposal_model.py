"""The surface as a mixture of few materials, each a BRDF in the basis: clusterwise regression.

Every material predicts every cell (its lightness and chromaticity under the light and view of the
photo). Every piece of the surface belongs to the material that predicts its cells best. Colour,
lightness and gloss are used together where photos show them; a piece without a highlight is
assigned by colour and lightness. (Späth 1979, clusterwise linear regression; Student-t errors as in
Peel & McLachlan 2000, robust mixture modelling.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..statistics.student_t import robust_cost, robust_weights
from .proposal_cells import KNOTS, NORMAL_ERROR, Cells

Array = NDArray[np.float64]
PRECISION = 300.0  # prior of a coefficient: training coefficients have variance 1/300
FREE_PRECISION = 10.0  # prior of a knot of the free curve: standard deviation 0.3 log units
LIGHTNESS, CHROMA = 0.08, 0.03  # log units: errors of a cell from noise and interreflections
MAX_ITERATIONS = 25  # of expectation maximisation


@dataclass(frozen=True)
class Mixture:
    """A mixture of K materials. coefficients: (K, 3, k) in the opponent channels; share: (K,) of
    the pieces; membership: (pieces, K) probabilities; likelihood: (pieces, K) log likelihood;
    scale: (2,) factors of the errors of lightness and chromaticity."""

    coefficients: Array
    share: Array
    membership: Array
    likelihood: Array
    scale: Array

    @property
    def labels(self) -> NDArray[np.intp]:
        """(pieces,) the most probable material of each piece."""
        return self.membership.argmax(axis=1)

    @property
    def total(self) -> float:
        """Log likelihood of all pieces."""
        return float(np.logaddexp.reduce(self.likelihood + np.log(self.share), axis=1).sum())


def errors(cells: Cells, coefficients: Array) -> Array:
    """(m, 3) standard errors of the cells for one material with coefficients (3, k). They include
    the error of the normals, which matters most where the lobe is steep and at grazing light."""
    here = cells.rows @ coefficients.T
    change = np.zeros((len(cells), 3))
    for rows, shift in zip(cells.tilted, cells.shift, strict=True):
        moved = rows @ coefficients.T - here
        moved[:, 0] += np.sqrt(3.0) * shift  # the mean is the same in all three channels
        change = np.maximum(change, np.abs(moved))
    slant = np.sqrt(3.0) * NORMAL_ERROR * cells.slant
    own = np.array([np.sqrt(3.0) * LIGHTNESS, CHROMA, CHROMA])
    variance = own**2 + change**2
    variance[:, 0] += slant**2
    return np.asarray(np.sqrt(variance))


def fit_mixture(
    cells: Cells, membership: Array, joined: csr_array | None = None, weight: float = 1.0
) -> Mixture:
    """Fit the materials to the cells by expectation maximisation, from an initial ``membership``
    (pieces, K).

    joined: (pieces, pieces) sparse adjacency of the pieces; weight: of a smoothness prior that
    favours the materials of adjacent pieces.
    """
    pieces, count = membership.shape
    k = cells.rows.shape[1]
    coefficients = np.zeros((count, 3, k))
    prior = np.diag(np.where(np.arange(k) < k - KNOTS, PRECISION, FREE_PRECISION))
    sigma = np.repeat(errors(cells, np.zeros((3, k)))[None], count, axis=0)
    heavy = np.ones((count, len(cells), 3))
    scale = np.ones(2)
    shares = None
    if joined is not None:
        degree = np.maximum(np.asarray(joined.sum(axis=1)).ravel(), 1e-9)
        shares = joined.multiply(1.0 / degree[:, None]).tocsr()
    before = -np.inf
    likelihood, share = np.zeros((pieces, count)), np.full(count, 1.0 / count)
    for turn in range(MAX_ITERATIONS):
        deviation = np.empty((count, len(cells), 3))
        for c in range(count):
            mine = membership[cells.piece, c]
            for channel in range(3):
                w = mine * heavy[c, :, channel] / sigma[c, :, channel] ** 2
                normal = (cells.rows * w[:, None]).T @ cells.rows + prior
                right = cells.rows.T @ (w * cells.seen[:, channel])
                coefficients[c, channel] = np.linalg.solve(normal, right)
            sigma[c] = errors(cells, coefficients[c])
            deviation[c] = (cells.seen - cells.rows @ coefficients[c].T) / sigma[c]
        scale = _scales(deviation, membership[cells.piece])
        factor = np.array([scale[0], scale[1], scale[1]])
        sigma *= factor
        deviation /= factor
        heavy = robust_weights(deviation)
        log = -robust_cost(deviation) - np.log(sigma)
        each = log.sum(axis=2)
        likelihood = np.stack([np.bincount(cells.piece, e, pieces) for e in each], axis=1)
        share = np.maximum(membership.mean(axis=0), 1e-4)
        share /= share.sum()
        value = likelihood + np.log(share)
        if shares is not None:
            value = value + weight * (shares @ membership)
        new = np.exp(value - np.logaddexp.reduce(value, axis=1, keepdims=True))
        membership = new
        total = float(np.logaddexp.reduce(likelihood + np.log(share), axis=1).sum())
        if abs(total - before) < 1e-4 * max(1.0, len(cells)) and turn > 4:
            break
        before = total
    return Mixture(coefficients.copy(), share, membership, likelihood, scale)


def _scales(deviation: Array, mine: Array) -> Array:
    """(2,) factors between actual and assumed errors, for lightness and chromaticity: medians over
    the cells under their own material (0.74 is the median |t| for four degrees of freedom)."""
    own = mine.argmax(axis=1)
    d = np.abs(deviation[own, np.arange(deviation.shape[1])])
    found = np.array([np.median(d[:, 0]), np.median(d[:, 1:])]) / 0.741
    return np.clip(found, 0.25, 10.0)


def cell_likelihood(cells: Cells, mixture: Mixture) -> Array:
    """(m, K) log likelihood of each cell under each material."""
    out = np.empty((len(cells), len(mixture.share)))
    factor = np.array([mixture.scale[0], mixture.scale[1], mixture.scale[1]])
    for c, coefficients in enumerate(mixture.coefficients):
        sigma = errors(cells, coefficients) * factor
        deviation = (cells.seen - cells.rows @ coefficients.T) / sigma
        log = -robust_cost(deviation) - np.log(sigma)
        out[:, c] = log.sum(axis=1)
    return out
