"""Choose the samples to solve from: those whose rows have the smallest condition number (Nielsen et
al. 2015, section 5; Ono et al. 2019, section 3.3).

Nielsen's search: grow the set by the best candidate, then exchange one of the set after the other
for the best candidate, until nothing improves. Each step finds exactly the best of all candidates
but computes few condition numbers: a closed formula bounds each from below (condition_bound.py),
and singular values are computed in the order of the bounds until these exceed the best value so
far.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .condition_bound import ConditionBound, condition_numbers

ROWS_AT_ONCE = 1 << 16

Allowed = Callable[[NDArray[np.intp]], NDArray[np.bool_]]
Best = Callable[[list[int], float], tuple[int, float] | None]

__all__ = ["Allowed", "choose", "condition_numbers"]


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
    first = longest_row(rows) if fixed is None else fixed
    return search(rows, first, count, best_of_all(rows, allowed), fixed, sweeps)


def longest_row(rows: NDArray[np.floating]) -> int:
    """The row (m, k) of largest norm, where Nielsen's search starts."""
    best, length = 0, -np.inf
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        part = rows[begin : begin + ROWS_AT_ONCE]
        squares = np.einsum("ij,ij->i", part, part)
        place = int(squares.argmax())
        if squares[place] > length:
            best, length = begin + place, float(squares[place])
    return best


def best_of_all(rows: NDArray[np.floating], allowed: Allowed | None = None) -> Best:
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
    return exchanged(rows, chosen, best, fixed, sweeps)


def exchanged(
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
