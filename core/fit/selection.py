"""Which samples to solve from: those whose rows have the smallest condition number
(Nielsen et al. 2015, section 5; the paper, section 3.3)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Allowed = Callable[[NDArray[np.intp]], NDArray[np.bool_]]


def condition_numbers(
    chosen: NDArray[np.floating], candidates: NDArray[np.floating]
) -> NDArray[np.float64]:
    """(m,) condition number of the chosen rows (j, k) with each candidate row (m, k) added."""
    m, k = candidates.shape
    stacked = np.empty((m, len(chosen) + 1, k))
    stacked[:, :-1] = chosen
    stacked[:, -1] = candidates
    values = np.linalg.svd(stacked, compute_uv=False)
    return values[:, 0] / np.maximum(values[:, -1], 1e-300)


def choose(
    rows: NDArray[np.floating],
    count: int,
    allowed: Allowed,
    fixed: int | None = None,
    sweeps: int = 10,
) -> NDArray[np.intp] | None:
    """Indices (count,) of a well-conditioned set: greedy growth, then coordinate descent.

    rows: (m, k). allowed(chosen) -> (m,) candidates that may join the chosen ones. fixed: a row
    that must be in the set. None where the constraint leaves too few candidates.
    """
    first = int(np.linalg.norm(rows, axis=1).argmax()) if fixed is None else fixed
    chosen = [first]
    while len(chosen) < count:
        best = _best(rows, chosen, allowed)
        if best is None:
            return None
        chosen.append(best[0])
    quality = np.linalg.cond(rows[chosen])
    for _ in range(sweeps):
        improved = False
        for slot in range(count):
            if fixed is not None and chosen[slot] == fixed:
                continue
            others = chosen[:slot] + chosen[slot + 1 :]
            best = _best(rows, others, allowed)
            if best is not None and best[1] < quality * (1 - 1e-9):
                chosen[slot], quality = best
                improved = True
        if not improved:
            break
    return np.array(chosen)


def _best(
    rows: NDArray[np.floating], chosen: list[int], allowed: Allowed
) -> tuple[int, float] | None:
    may = allowed(np.array(chosen))
    may[chosen] = False
    candidates = np.flatnonzero(may)
    if candidates.size == 0:
        return None
    numbers = condition_numbers(rows[chosen], rows[candidates])
    best = int(numbers.argmin())
    return int(candidates[best]), float(numbers[best])
