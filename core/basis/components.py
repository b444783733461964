"""Principal components of mapped reflectance by the Gram matrix (Ono et al. 2019, equations (1) and
(2)).

X is the n_columns × n_cells matrix of mapped observations after subtracting the mean (equation
(1)), X = W Σ Vᵀ its SVD (equation (2)). X Xᵀ = W Σ² Wᵀ is small (300 × 300 for MERL). The scaled
components are Q = V·Σ = Xᵀ W, so W and the mapped observations in a direction give the components
in ANY direction: there is no SVD of a million rows and no resampling.

The components of other measured materials, for the prior of the estimator, are in
residual_components.py.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray


def gram_matrix(blocks: Iterable[NDArray[np.float32]], columns: int) -> NDArray[np.float64]:
    """X Xᵀ (columns, columns) from blocks (columns, cells) of mapped, centred observations
    (equation (1))."""
    gram = np.zeros((columns, columns))
    for block in blocks:
        wide = block.astype(np.float64)
        gram += wide @ wide.T
    return gram


def principal_directions(
    gram: NDArray[np.float64], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(W (columns, count), explained variance fractions (columns,)), largest first (equation (2)).

    The sign of each direction is fixed (its largest entry is positive), so that the same input
    gives the same components.
    """
    eigenvalues, vectors = np.linalg.eigh(gram)
    eigenvalues, vectors = eigenvalues[::-1], vectors[:, ::-1]
    peak = np.abs(vectors).argmax(axis=0)
    vectors = vectors * np.sign(vectors[peak, np.arange(vectors.shape[1])])
    return vectors[:, :count].copy(), eigenvalues / eigenvalues.sum()
