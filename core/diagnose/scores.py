"""What groups of pixels pull at the numbers of an effect that is not in the model yet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from .equations import Equations, scaled
from .fitted import Fitted, weights
from .slopes import Slopes

Array = NDArray[np.floating]


def scores(fitted: Fitted, slopes: Slopes, of: NDArray[np.intp], last: int) -> tuple[Array, Array]:
    """(pull (b, last) of each group ``of`` pixels (n,) at the last numbers, the part that all other
    unknowns could follow taken out; metric (last / e, e, e), inverse of these numbers' information:
    one block where there are few, one a patch where there are many)."""
    model, n = fitted.model, len(of)
    whole = Equations.of(fitted, slopes, np.arange(n))
    k = model.brdfs.coefficients.shape[2]
    groups = int(of.max()) + 1
    usual = fitted.joined(lambda numbers: numbers.deviation)
    own = whole.own + np.diag(1 / usual**2)
    both = np.concatenate([whole.coupling, whole.local_coupling], axis=1)
    p = slopes.count
    pull = np.zeros((groups, both.shape[1]))
    local_own = whole.local_own
    projectors = []
    for index, block in enumerate(whole.blocks.reshape(-1, k, k)):
        rows = slice(k * index, k * index + k)
        projector = np.linalg.solve(block + np.diag(1 / model.brdfs.variance), both[rows])
        projectors.append(projector)
        own = own - both[rows, :p].T @ projector[:, :p]
        local_own = local_own - both[rows, :p].T @ projector[:, p:]
    for index in range(len(model.brdfs.coefficients)):
        mine = np.flatnonzero(model.pixels.material == index)
        one = (np.ones(len(mine), np.float32), of[mine], np.arange(len(mine) + 1))
        member = csr_array(one, shape=(len(mine), groups)).T
        for c in range(3):
            r = fitted.residual[mine, c]
            wr = (weights(r) * r).astype(np.float32)
            pull[:, :p] += (member @ scaled(slopes.matrix(mine, c), wr)).toarray()
            if slopes.patches:
                pull[:, p:] += (member @ scaled(slopes.local_matrix(mine, c), wr)).toarray()
            by_group = member @ (slopes.q[mine] * (wr * slopes.rho[mine, c])[:, None])
            pull -= by_group @ projectors[3 * index + c]
    if slopes.patches:
        if p:
            pull[:, p:] -= pull[:, :p] @ np.linalg.solve(own, local_own)
        count, e, _ = whole.local.shape
        prior = model.effects[-1].numbers.deviation.reshape(count, e)
        blocks = whole.local + np.einsum("pe,ef->pef", 1 / prior**2, np.eye(e))
        return pull[:, p:], np.linalg.inv(blocks)
    first = p - last
    if first:
        others = np.linalg.solve(own[:first, :first], own[:first, first:])
        pull = pull[:, first:] - pull[:, :first] @ others
        own = own[first:, first:] - own[first:, :first] @ others
    return pull, np.linalg.inv(own)[None]
