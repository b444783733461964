"""The best of millions of candidate rows, by bounds on whole cells of them.

Every cell is represented by one of its rows and an extent: the largest difference of each component
of the other rows from it. One bound on the condition number holds for all rows of a cell. Cells are
grouped into larger cells; those whose bound exceeds the best value so far are never opened.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles
from patina.core.fit.condition_bound import (
    FIRST_BATCH,
    ROUNDING,
    ROUNDING_32,
    SINGLE_PRECISION_LIMIT,
    ConditionBound,
    condition_numbers,
)

KNEE = np.radians(2.0)  # cells in θh are uniform below and grow above: lobes are narrow
BITS = 7, 7, 7  # of the cell number, for θh, θd and φd
COARSE, LEVELS = 2, 3  # bits per angle dropped at each larger size of cells; number of sizes
COPY_RATIO = 8  # more than 1/8 of a level's cells are bounded without copying them
ROWS_AT_ONCE = 1 << 17
MAX_THREADS = 4


def angle_cells(angles: Angles) -> NDArray[np.int32]:
    """(m,) cell numbers of half/difference angles (m,), radians, for choose_from_cells. The cells
    of one larger cell have consecutive numbers."""
    h = np.log1p(angles.theta_h / KNEE) / np.log1p(np.pi / 2 / KNEE)
    parts = (h, angles.theta_d / (np.pi / 2), np.mod(angles.phi_d / np.pi, 1.0))
    cells = [
        np.clip(value * (1 << bits), 0, (1 << bits) - 1).astype(np.int32)
        for value, bits in zip(parts, BITS, strict=True)
    ]
    number = np.zeros(len(h), np.int32)
    shifts = [COARSE * level for level in reversed(range(LEVELS))]
    for shift in shifts:  # bits of the largest cells for all angles, then of the next size
        for cell, bits in zip(cells, BITS, strict=True):
            kept = bits - shift if shift == shifts[0] else COARSE
            number = (number << kept) | ((cell >> shift) & ((1 << kept) - 1))
    return number


@dataclass(frozen=True)
class _Level:
    """Cells of one size, as ranges of the cells (or rows) of the next smaller size. begin, end:
    (c,) ranges; place: (c,) index of the representative in the tree's rows; rows: (c, k)
    representatives; extent: (c, k)."""

    begin: NDArray[np.intp]
    end: NDArray[np.intp]
    place: NDArray[np.intp]
    rows: NDArray[np.floating]
    extent: NDArray[np.floating]

    def of(self, which: NDArray[np.intp]) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """(representatives, extents) of some cells, in ascending order."""
        if len(which) == len(self.begin):
            return self.rows, self.extent
        return self.rows[which], self.extent[which]

    def possible(
        self, bound: ConditionBound, which: NDArray[np.intp], known: float
    ) -> NDArray[np.intp]:
        """Those of the cells ``which`` (ascending) that a quick bound does not exclude."""
        if known > SINGLE_PRECISION_LIMIT:
            return which
        if len(which) * COPY_RATIO > len(self.begin):
            return which[bound.possible(self.rows, known, self.extent)[which]]
        return which[bound.possible(self.rows[which], known, self.extent[which])]


@dataclass(frozen=True)
class CandidateTree:
    """rows: (m, k) float32 candidates, sorted by cell; order: (m,) their original indices; inverse:
    (m,) their sorted position by original index; levels: from the largest cells to the smallest,
    whose ranges are ranges of rows."""

    rows: NDArray[np.float32]
    order: NDArray[np.intp]
    inverse: NDArray[np.int32]
    levels: tuple[_Level, ...]

    @classmethod
    def of(cls, rows: NDArray[np.floating], cells: NDArray[np.integer]) -> CandidateTree:
        """The tree of rows (m, k) with these cell numbers (m,)."""
        # sorting numbers with their index in the low bits is much faster than argsort, and stable
        packed = np.sort(cells.astype(np.int64) << 32 | np.arange(len(cells)))
        order, number = packed & 0xFFFFFFFF, packed >> 32
        del packed
        sorted_rows = np.empty(rows.shape, np.float32)

        def sort(part: slice) -> None:
            sorted_rows[part] = rows.take(order[part], axis=0)

        _for_all([slice(b, b + ROWS_AT_ONCE) for b in range(0, len(order), ROWS_AT_ONCE)], sort)
        levels: list[_Level] = []
        below: _Level | None = None
        for _ in range(LEVELS):
            below = _level(number, sorted_rows, below)
            levels.insert(0, below)
            number = number[below.begin] >> (3 * COARSE)
        inverse = np.empty(len(order), np.int32)
        inverse[order] = np.arange(len(order), dtype=np.int32)
        return cls(sorted_rows, order, inverse, tuple(levels))

    def smallest(
        self, bound: ConditionBound, without: list[int], limit: float = np.inf
    ) -> tuple[int, float] | None:
        """(index, condition number) of the row that gives the smallest condition number together
        with the bound's rows, except the rows ``without``; None where none is below ``limit``."""
        taken = self.inverse[without]
        known = limit * (1 + ROUNDING)
        inside = np.arange(len(self.levels[0].begin))
        for level in self.levels:
            inside = level.possible(bound, inside, known)
            if not np.isfinite(limit):
                known = min(known, _number_of_representatives(bound, level, inside, taken))
            rows, extent = level.of(inside)
            margin = ROUNDING if known > SINGLE_PRECISION_LIMIT else ROUNDING_32
            largest, smallest = bound.extremes(rows, extent, single=known <= SINGLE_PRECISION_LIMIT)
            inside = _ranges(level, inside[largest * (1 - margin) <= known * smallest])
        inside = inside[~np.isin(inside, taken)]
        if len(inside) > FIRST_BATCH:
            rows = self.rows[inside]
            if known <= SINGLE_PRECISION_LIMIT:
                possible = bound.possible(rows, known)
                inside, rows = inside[possible], rows[possible]
            margin = ROUNDING if known > SINGLE_PRECISION_LIMIT else ROUNDING_32
            largest, smallest = bound.extremes(rows, single=known <= SINGLE_PRECISION_LIMIT)
            inside = inside[largest * (1 - margin) <= known * smallest]
        found = bound.smallest(self.rows[inside], limit) if len(inside) else None
        return None if found is None else (int(self.order[inside[found[0]]]), found[1])


def _for_all(parts: Sequence[slice], work: Callable[[slice], None]) -> None:
    """Do independent pieces of work, on several threads where there are several."""
    workers = min(MAX_THREADS, os.cpu_count() or 1, len(parts))
    if workers < 2:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, parts))


def _level(number: NDArray[np.integer], rows: NDArray[np.float32], below: _Level | None) -> _Level:
    """Cells of equal numbers (n,), made of rows or of the cells of the level below."""
    begin = np.flatnonzero(np.concatenate([[True], number[1:] != number[:-1]]))
    end = np.concatenate([begin[1:], [len(number)]])
    middle = (begin + end) // 2
    if below is not None:
        rows = below.rows
    centre = rows[middle]
    extent = np.empty_like(centre)

    def reach(cells: slice) -> None:
        part = slice(begin[cells.start], end[cells.stop - 1])
        away = rows[part] - np.repeat(centre[cells], (end - begin)[cells], axis=0)
        np.abs(away, out=away)
        if below is not None:
            away += below.extent[part]
        extent[cells] = np.maximum.reduceat(away, begin[cells] - begin[cells.start], axis=0)

    pieces, first = [], 0
    while first < len(begin):  # whole cells at a time
        last = max(first + 1, int(np.searchsorted(begin, begin[first] + ROWS_AT_ONCE)))
        pieces.append(slice(first, last))
        first = last
    _for_all(pieces, reach)
    return _Level(begin, end, middle if below is None else below.place[middle], centre, extent)


def _number_of_representatives(
    bound: ConditionBound, level: _Level, which: NDArray[np.intp], taken: NDArray[np.intp]
) -> float:
    """Smallest condition number with one of the FIRST_BATCH most promising representatives of some
    cells."""
    which = which[~np.isin(level.place[which], taken)]
    if not len(which):
        return np.inf
    rows = level.of(which)[0]
    promise = bound.bounds(rows)
    some = np.argpartition(promise, min(FIRST_BATCH, len(which)) - 1)[:FIRST_BATCH]
    return float(condition_numbers(bound.chosen, rows[some]).min()) * (1 + ROUNDING)


def _ranges(level: _Level, which: NDArray[np.intp]) -> NDArray[np.intp]:
    """All indices in the ranges of some cells, one range after the other."""
    begin, count = level.begin[which], (level.end - level.begin)[which]
    total = int(count.sum())
    start = np.cumsum(count) - count
    return np.repeat(begin - start, count) + np.arange(total)
