"""Simple implementation of the sample selection, for comparison: a singular value decomposition for
every candidate at every step (Nielsen et al. 2015, section 5)."""

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
    """Select rows greedily, then replace one row after the other by the best of all candidates.

    Returns indices (count,), or None if no candidate is allowed.
    """
    selected = [int(np.linalg.norm(rows, axis=1).argmax()) if fixed is None else fixed]
    while len(selected) < count:
        best = _best(rows, selected, allowed)
        if best is None:
            return None
        selected.append(best[0])
    quality = np.linalg.cond(rows[selected])
    for _ in range(sweeps if count > 1 else 0):
        improved = False
        for slot in range(count):
            if fixed is not None and selected[slot] == fixed:
                continue
            best = _best(rows, selected[:slot] + selected[slot + 1 :], allowed)
            if best is not None and best[1] < quality * (1 - 1e-9):
                selected[slot], quality = best
                improved = True
        if not improved:
            break
    return np.array(selected)


def _best(
    rows: np.ndarray, selected: list[int], allowed: Callable[[np.ndarray], np.ndarray]
) -> tuple[int, float] | None:
    permitted = allowed(np.array(selected))
    permitted[selected] = False
    candidates = np.flatnonzero(permitted)
    if candidates.size == 0:
        return None
    stacked = np.empty((len(candidates), len(selected) + 1, rows.shape[1]))
    stacked[:, :-1] = rows[selected]
    stacked[:, -1] = rows[candidates]
    values = np.linalg.svd(stacked, compute_uv=False)
    conditions = values[:, 0] / np.maximum(values[:, -1], 1e-300)
    best = int(conditions.argmin())
    return int(candidates[best]), float(conditions[best])
