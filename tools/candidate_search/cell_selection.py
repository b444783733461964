"""Well-conditioned samples out of millions of candidates: measured by `run.py bench speed`.

The estimators choose from thousands of samples (core/fit/selection.py) and do not need this.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from patina.core.fit.condition_bound import ConditionBound
from patina.core.fit.selection import best_of_all, exchanged, longest_row, search

from .candidate_tree import CandidateTree

MAX_FULL_SEARCH = 64_000_000  # numbers in the rows up to which all candidates are searched
STARTS = 6  # starts of the search, in addition to Nielsen's
FULL_SWEEPS = 2  # sweeps over all candidates, after those over the larger cells


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
            found.append(exchanged(rows, start, best, None, min(sweeps, FULL_SWEEPS)))
    if not found or not many:
        whole = search(rows, longest_row(rows), count, best, None, sweeps)
        found += [] if whole is None else [whole]
    numbers = [float(np.linalg.cond(rows[one].astype(np.float64))) for one in found]
    return found[int(np.argmin(numbers))] if found else None


def _best_of_starts(rows: NDArray[np.floating], count: int, sweeps: int) -> NDArray[np.intp] | None:
    """The best set of searches that start from several of the rows (m, k)."""
    everywhere = np.linspace(0, len(rows) - 1, STARTS + 1).astype(np.intp)[1:]
    best = best_of_all(rows)
    found = [
        search(rows, first, count, best, None, sweeps)
        for first in dict.fromkeys([longest_row(rows), *everywhere.tolist()])
    ]
    sets = [one for one in found if one is not None]
    numbers = [float(np.linalg.cond(rows[one].astype(np.float64))) for one in sets]
    return sets[int(np.argmin(numbers))] if sets else None
