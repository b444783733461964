"""Choose the samples to solve from: those whose rows have the smallest condition number (Nielsen et
al. 2015, section 5; Ono et al. 2019, section 3.3).

Nielsen's search: grow the set by the best candidate, then exchange one of the set after the other
for the best candidate, until nothing improves. Each step finds exactly the best of all candidates
but computes few condition numbers: a closed formula bounds each from below (condition_bound.py),
and singular values are computed in the order of the bounds until these exceed the best value so
far. Millions of candidates are bounded by the cells of a tree (candidate_tree.py).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .candidate_tree import CandidateTree
from .condition_bound import ConditionBound, condition_numbers

MAX_FULL_SEARCH = 64_000_000  # numbers in the rows up to which all candidates are searched
STARTS = 6  # starts of the search, in addition to Nielsen's
FULL_SWEEPS = 2  # sweeps over all candidates, after those over the larger cells
ROWS_AT_ONCE = 1 << 16

Allowed = Callable[[NDArray[np.intp]], NDArray[np.bool_]]
Best = Callable[[list[int], float], tuple[int, float] | None]

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
    that must be in the set. sweeps: largest number of passes of exchanges. None where the
    constraint leaves too few candidates.
    """
    first = _longest(rows) if fixed is None else fixed
    return search(rows, first, count, _all_of(rows, allowed), fixed, sweeps)


def choose_from_cells(
    rows: NDArray[np.floating],
    cells: NDArray[np.integer],
    count: int,
    sweeps: int = 10,
) -> NDArray[np.intp] | None:
    """A set as good as choose() finds without constraints, for very many candidates.

    rows: (m, k). cells: (m,) cell number of each; rows of one cell are similar, and rows of
    consecutive cells somewhat (angle_cells of their angles).

    The search first runs on one candidate of every larger cell, from several starts; the best set
    found is improved by exchanges with all candidates. Up to MAX_FULL_SEARCH numbers Nielsen's
    search runs on all candidates too, and the better set is taken, so that none is worse than that
    of choose(). Beyond, that search alone would take minutes, and several starts have found better
    sets than its single one (measured by ``run.py bench speed``).
    """
    tree = CandidateTree.of(rows, cells)
    places = tree.order[tree.levels[1].place]
    many = rows.size > MAX_FULL_SEARCH

    def best(chosen: list[int], limit: float) -> tuple[int, float] | None:
        return tree.smallest(ConditionBound.of(rows[chosen]), chosen, limit)

    found: list[NDArray[np.intp]] = []
    if len(places) >= 2 * count:
        some = _best_of_starts(rows[places], count, sweeps)
        if some is not None:
            start = places[some].tolist()
            found.append(_exchanged(rows, start, best, None, min(sweeps, FULL_SWEEPS)))
    if not found or not many:
        whole = search(rows, _longest(rows), count, best, None, sweeps)
        found += [] if whole is None else [whole]
    numbers = [float(np.linalg.cond(rows[one].astype(np.float64))) for one in found]
    return found[int(np.argmin(numbers))] if found else None


def _best_of_starts(rows: NDArray[np.floating], count: int, sweeps: int) -> NDArray[np.intp] | None:
    """The best set of searches that start from several of the rows (m, k)."""
    everywhere = np.linspace(0, len(rows) - 1, STARTS + 1).astype(np.intp)[1:]
    best = _all_of(rows)
    found = [
        search(rows, first, count, best, None, sweeps)
        for first in dict.fromkeys([_longest(rows), *everywhere.tolist()])
    ]
    sets = [one for one in found if one is not None]
    numbers = [float(np.linalg.cond(rows[one].astype(np.float64))) for one in sets]
    return sets[int(np.argmin(numbers))] if sets else None


def _longest(rows: NDArray[np.floating]) -> int:
    """The row (m, k) of largest norm, where Nielsen's search starts."""
    best, length = 0, -np.inf
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        part = rows[begin : begin + ROWS_AT_ONCE]
        squares = np.einsum("ij,ij->i", part, part)
        place = int(squares.argmax())
        if squares[place] > length:
            best, length = begin + place, float(squares[place])
    return best


def _all_of(rows: NDArray[np.floating], allowed: Allowed | None = None) -> Best:
    """The function ``best`` of search() for rows (m, k), under a constraint."""

    def best(chosen: list[int], limit: float) -> tuple[int, float] | None:
        possible = np.ones(len(rows), bool) if allowed is None else allowed(np.array(chosen))
        possible[chosen] = False
        candidates = np.flatnonzero(possible)
        if candidates.size == 0:
            return None
        found = ConditionBound.of(rows[chosen]).smallest(rows[candidates], limit)
        return None if found is None else (int(candidates[found[0]]), found[1])

    return best


def search(
    rows: NDArray[np.floating],
    first: int,
    count: int,
    best: Best,
    fixed: int | None = None,
    sweeps: int = 10,
) -> NDArray[np.intp] | None:
    """Greedy growth from one row, then exchanges; None where candidates run out.

    best(chosen, limit): (candidate, condition number) of the row that gives the chosen ones the
    smallest condition number; None where it is not below limit.
    """
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
    best: Best,
    fixed: int | None,
    sweeps: int,
) -> NDArray[np.intp]:
    """The set after exchanges of one row at a time, until none improves it."""
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
