"""The plain way to choose samples, to measure the program's against: a singular value decomposition
for every candidate at every step (Nielsen et al. 2015, section 5)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def choose_plainly(
    rows: np.ndarray,
    count: int,
    allowed: Callable[[np.ndarray], np.ndarray],
    fixed: int | None = None,
    sweeps: int = 10,
) -> np.ndarray | None:
    """Greedy growth, then one row after the other exchanged for the best of all candidates."""
    chosen = [int(np.linalg.norm(rows, axis=1).argmax()) if fixed is None else fixed]
    while len(chosen) < count:
        best = _best(rows, chosen, allowed)
        if best is None:
            return None
        chosen.append(best[0])
    quality = np.linalg.cond(rows[chosen])
    for _ in range(sweeps if count > 1 else 0):
        improved = False
        for slot in range(count):
            if fixed is not None and chosen[slot] == fixed:
                continue
            best = _best(rows, chosen[:slot] + chosen[slot + 1 :], allowed)
            if best is not None and best[1] < quality * (1 - 1e-9):
                chosen[slot], quality = best
                improved = True
        if not improved:
            break
    return np.array(chosen)


def _best(
    rows: np.ndarray, chosen: list[int], allowed: Callable[[np.ndarray], np.ndarray]
) -> tuple[int, float] | None:
    may = allowed(np.array(chosen))
    may[chosen] = False
    candidates = np.flatnonzero(may)
    if candidates.size == 0:
        return None
    stacked = np.empty((len(candidates), len(chosen) + 1, rows.shape[1]))
    stacked[:, :-1] = rows[chosen]
    stacked[:, -1] = rows[candidates]
    values = np.linalg.svd(stacked, compute_uv=False)
    numbers = values[:, 0] / np.maximum(values[:, -1], 1e-300)
    best = int(numbers.argmin())
    return int(candidates[best]), float(numbers[best])
