"""The score test of an effect that is not in the model yet (Rao 1948), by groups of pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ...statistics.student_t import robust_weights
from ..solver.block_elimination import EliminatedBlocks, with_prior
from ..solver.jacobian import Jacobian
from ..solver.model_fit import ModelFit
from ..solver.normal_equations import NormalEquations, scaled

Array = NDArray[np.floating]


def scores(
    fit: ModelFit, jacobian: Jacobian, group: NDArray[np.intp], last: int
) -> tuple[Array, Array]:
    """Scores of the last parameters of a model, all other unknowns eliminated.

    group: (n,) of each pixel; last: number of parameters. Returns (score (b, last) of each group,
    metric (last / e, e, e): the inverse information of these parameters, one block where they are
    few, one a patch where they are many).
    """
    model, n = fit.model, len(group)
    whole = NormalEquations.of(fit, jacobian, np.arange(n))
    groups, p = int(group.max()) + 1, jacobian.count
    both = np.concatenate([whole.coupling, whole.local_coupling], axis=1)
    eliminated = EliminatedBlocks.of(whole.blocks, model.brdfs.variance, both)
    own = eliminated.schur_complement(with_prior(whole, fit), both[:, :p], slice(0, p))
    local_own = eliminated.schur_complement(whole.local_own, both[:, :p], slice(p, None))
    score = np.zeros((groups, both.shape[1]))
    for index in range(len(model.brdfs.coefficients)):
        mine = np.flatnonzero(model.pixels.material == index)
        one = (np.ones(len(mine), np.float32), group[mine], np.arange(len(mine) + 1))
        member = csr_array(one, shape=(len(mine), groups)).T
        for c in range(3):
            r = fit.residual[mine, c]
            wr = (robust_weights(r) * r).astype(np.float32)
            score[:, :p] += (member @ scaled(jacobian.matrix(mine, c), wr)).toarray()
            if jacobian.patches:
                score[:, p:] += (member @ scaled(jacobian.local_matrix(mine, c), wr)).toarray()
            by_group = member @ (jacobian.q[mine] * (wr * jacobian.rho[mine, c])[:, None])
            score -= by_group @ eliminated.solutions[3 * index + c]
    if jacobian.patches:
        if p:
            score[:, p:] -= score[:, :p] @ np.linalg.solve(own, local_own)
        count, e, _ = whole.local.shape
        prior = model.effects[-1].parameters.deviation.reshape(count, e)
        blocks = whole.local + np.einsum("pe,ef->pef", 1 / prior**2, np.eye(e))
        return score[:, p:], np.linalg.inv(blocks)
    first = p - last
    if first:
        others = np.linalg.solve(own[:first, :first], own[:first, first:])
        score = score[:, first:] - score[:, :first] @ others
        own = own[first:, first:] - own[first:, :first] @ others
    return score, np.linalg.inv(own)[None]
