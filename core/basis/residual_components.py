"""Components for materials that are not in the database of the basis.

The principal components of MERL (components.py) span what its hundred materials do. Other measured
materials, such as car paints, differ from all of them. Further components of a basis are therefore
the principal components of what those of MERL leave of ALL measured materials, those of MERL and
the others. The coefficients of all of them are what the prior is learnt from
(fit/measured/prior.py).

Everything is computed from the Gram matrix of the columns, as in components.py: a component is a
weighted sum of centred columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .components import principal_directions

OTHERS_COUNT = 30
"""Components in addition to those of the database, where there are other materials."""

MIN_SHARE = 1e-6  # of the variance that a component explains: below it is rounding


@dataclass(frozen=True)
class ComponentWeights:
    """k components as weighted sums of n centred columns.

    weights: (n, k); component i is Σⱼ weights[j, i] · column j. coefficients: (n, k) of the
    columns, by least squares over the cells. explained: fractions of the variance of the database's
    columns, largest first, of all their principal components.
    """

    weights: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    explained: NDArray[np.float64]


def component_weights(gram: NDArray[np.float64], columns: int, count: int) -> ComponentWeights:
    """``count`` principal components of the first ``columns`` of n columns, and OTHERS_COUNT of
    what these leave of all n, where there are others.

    gram: (n, n) products of the columns, centred by the mean of the first ``columns``.
    The root mean square of the coefficients of each component is 1/√columns over the columns that
    it was computed from, as in equation (2).
    """
    n = len(gram)
    own = gram[:columns, :columns]
    if n == columns:
        directions, explained = principal_directions(own, count)
        return ComponentWeights(directions, directions, explained)
    directions, explained = principal_directions(own, count)
    first = int(np.sum(explained[: directions.shape[1]] > MIN_SHARE))
    directions = directions[:, :first]
    weights = np.concatenate([directions, np.zeros((n - columns, first))])
    coefficients = _least_squares(gram, weights)
    residual = np.eye(n) - weights @ coefficients.T
    found, shares = principal_directions(residual.T @ gram @ residual, OTHERS_COUNT)
    rest = residual @ found[:, shares[:OTHERS_COUNT] > MIN_SHARE]
    each = _least_squares(gram, rest)
    scale = np.sqrt(np.mean(each**2, axis=0) * columns)
    weights = np.concatenate([weights, rest * scale], axis=1)
    coefficients = np.concatenate([coefficients, each / scale], axis=1)
    return ComponentWeights(weights, coefficients, explained)


def centred(products: NDArray[np.float64], columns: int) -> NDArray[np.float64]:
    """(n, n) products of n columns after subtracting the mean of the first ``columns`` of them."""
    own = products[:columns, :columns].mean()
    across = products[:, :columns].mean(axis=1)
    found: NDArray[np.float64] = products - across[:, None] - across[None] + own
    return found


def _least_squares(gram: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, k) coefficients of all columns in the components with these weights (n, k)."""
    right = gram @ weights
    found: NDArray[np.float64] = np.linalg.solve(weights.T @ right, right.T).T
    return found
