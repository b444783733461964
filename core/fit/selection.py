"""Which samples to solve from: those whose rows have the smallest condition number
(Nielsen et al. 2015, section 5; the paper, section 3.3).

Nielsen's search: grow the set by the best candidate, then exchange one of the set after the other
for the best candidate, until nothing gets better. Each step asks for the best of all candidates,
and finds exactly that one, but computes few condition numbers: a closed formula bounds each from
below, and singular values are computed in the order of the bounds until these exceed what is found.
Millions of candidates are bounded many at once, by the cells of a tree (candidate_tree.py).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .candidate_tree import CandidateTree
from .condition_bound import ConditionBound, condition_numbers

MANY = 64_000_000  # numbers in the rows up to which nothing is left to chance

Allowed = Callable[[NDArray[np.intp]], NDArray[np.bool_]]

__all__ = ["Allowed", "choose", "choose_from_cells", "condition_numbers"]


def choose(
    rows: NDArray[np.floating],
    count: int,
    allowed: Allowed | None = None,
    fixed: int | None = None,
    sweeps: int = 10,
) -> NDArray[np.intp] | None:
    """Indices (count,) of a well-conditioned set: greedy growth, then coordinate descent.

    rows: (m, k). allowed(chosen) -> (m,) candidates that may join the chosen ones. fixed: a row
    that must be in the set. None where the constraint leaves too few candidates.
    """

    def best(chosen: list[int], limit: float) -> tuple[int, float] | None:
        if allowed is None:
            may = np.ones(len(rows), bool)
        else:
            may = allowed(np.array(chosen))
        may[chosen] = False
        candidates = np.flatnonzero(may)
        if candidates.size == 0:
            return None
        bound = ConditionBound.of(rows[chosen])
        found = bound.smallest(rows[candidates], limit)
        return None if found is None else (int(candidates[found[0]]), found[1])

    first = int(np.linalg.norm(rows, axis=1).argmax()) if fixed is None else fixed
    return _search(rows, first, count, best, fixed, sweeps)


def choose_from_cells(
    rows: NDArray[np.floating],
    cells: NDArray[np.integer],
    count: int,
    sweeps: int = 10,
) -> NDArray[np.intp] | None:
    """A set as good as choose() finds without constraints, for very many candidates.

    rows: (m, k). cells: (m,) the number of a cell of each, rows of one cell being much alike and
    rows of neighbouring numbers somewhat (angle_cells of their angles).

    The search first runs on one candidate of every larger cell, then goes on from there with all of
    them. Up to MANY numbers it runs on all of them from its beginning as well, and the better set
    is taken: none is then worse than choose()'s.
    """
    tree = CandidateTree.of(rows, cells)
    places = tree.order[tree.levels[1].place]

    def best(chosen: list[int], limit: float) -> tuple[int, float] | None:
        return tree.smallest(ConditionBound.of(rows[chosen]), chosen, limit)

    found: list[NDArray[np.intp]] = []
    if len(places) >= 2 * count:
        some = choose(rows[places], count, sweeps=sweeps)
        if some is not None:
            start = places[some].tolist()
            found.append(_exchanged(rows, start, best, None, sweeps))
    if not found or rows.size <= MANY:
        squares = np.concatenate(
            [
                np.einsum("ij,ij->i", part, part)
                for part in np.array_split(rows, max(1, len(rows) >> 16))
            ]
        )
        whole = _search(rows, int(squares.argmax()), count, best, None, sweeps)
        found += [] if whole is None else [whole]
    numbers = [float(np.linalg.cond(rows[one])) for one in found]
    return found[int(np.argmin(numbers))] if found else None


def _search(
    rows: NDArray[np.floating],
    first: int,
    count: int,
    best: Callable[[list[int], float], tuple[int, float] | None],
    fixed: int | None,
    sweeps: int,
) -> NDArray[np.intp] | None:
    """Greedy growth from one row, then exchanges. best(chosen, limit): the candidate with which the
    chosen ones have the smallest condition number, and that number; None where it is not below."""
    chosen = [first]
    while len(chosen) < count:
        found = best(chosen, np.inf)
        if found is None:
            return None
        chosen.append(found[0])
    return _exchanged(rows, chosen, best, fixed, sweeps)


def _exchanged(
    rows: NDArray[np.floating],
    chosen: list[int],
    best: Callable[[list[int], float], tuple[int, float] | None],
    fixed: int | None,
    sweeps: int,
) -> NDArray[np.intp]:
    """The set after exchanges of one row at a time, until none makes it better."""
    quality = float(np.linalg.cond(rows[chosen]))
    for _ in range(sweeps if len(chosen) > 1 else 0):
        improved = False
        for slot, row in enumerate(chosen):
            if row == fixed:
                continue
            found = best(chosen[:slot] + chosen[slot + 1 :], quality * (1 - 1e-9))
            if found is not None:
                chosen[slot], quality = found
                improved = True
        if not improved:
            break
    return np.array(chosen)
