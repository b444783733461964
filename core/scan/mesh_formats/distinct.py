"""Find the distinct rows of an integer table, at the cost of one integer sort."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

HASH_MULTIPLIERS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def distinct_rows(rows: NDArray[np.integer]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(m,) index of the first occurrence of each distinct row of ``rows`` (n, k), ascending, and
    (n,) the index of each row in that list."""
    if not len(rows):
        return np.empty(0, np.intp), np.empty(0, np.intp)
    key = np.zeros(len(rows), np.uint64)
    with np.errstate(over="ignore"):
        for k in range(rows.shape[1]):
            key = (key ^ rows[:, k].astype(np.int64).view(np.uint64)) * HASH_MULTIPLIERS[k % 3]
            key ^= key >> np.uint64(29)
    order = np.argsort(key, kind="stable")
    differs = _differs(rows, order)
    if (
        differs & (key[order[1:]] == key[order[:-1]])
    ).any():  # different rows with equal keys: sort the rows themselves
        order = np.lexsort(tuple(rows.T))
        differs = _differs(rows, order)
    group = np.concatenate([[0], np.cumsum(differs)])
    first = order[np.concatenate([[True], differs])]
    ascending = np.argsort(first)
    rank = np.empty(len(first), np.intp)
    rank[ascending] = np.arange(len(first))
    number = np.empty(len(rows), np.intp)
    number[order] = rank[group]
    return first[ascending], number


def _differs(rows: NDArray[np.integer], order: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(n − 1,) whether each row, in the given order, differs from the previous one."""
    differs = np.zeros(len(rows) - 1, bool)
    for k in range(rows.shape[1]):
        column = rows[order, k]
        differs |= column[1:] != column[:-1]
    return differs


def distinct_places(
    positions: NDArray[np.float64], colours: NDArray[np.uint8] | None = None
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """``distinct_rows`` of positions (v, 3) that are equal in every bit (−0 and 0 are the same),
    and in colour where colours are given."""
    columns = [np.ascontiguousarray(positions + 0.0).view(np.int64)]
    if colours is not None:
        columns.append(colours.astype(np.int64) @ np.array([[65536], [256], [1]]))
    return distinct_rows(np.concatenate(columns, axis=1) if len(columns) > 1 else columns[0])
