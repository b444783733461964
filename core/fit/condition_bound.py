"""Lower bounds on the condition number of some rows and one more row, without singular values.

With the singular values s and right singular vectors V of the rows, the squared singular values of
the rows and a further row q are the roots of 1 + Σ zᵢ² / (sᵢ² − λ) = 0, z = Vᵀ q, with a pole at 0
for the part of q outside the rows' span (Golub 1973, "Some modified matrix eigenvalue problems").
The smallest root lies between the two smallest poles. Evaluating the terms of the other poles at
the smallest pole makes the sum too small, so the root of the remaining quadratic is an upper bound
on the true root.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ROWS_AT_ONCE = 1 << 14  # their products stay in the processor's cache
FIRST_BATCH, BATCH = 16, 32  # condition numbers computed at a time
HALVINGS = 0, 2, 6, 30  # of a bound's interval, in turn while there are many contenders
ROUNDING = 1e-6  # relative: bounds are lowered by it so that rounding excludes no candidate
ROUNDING_32 = 1e-3  # the same in float32, for condition numbers up to that limit
SINGLE_PRECISION_LIMIT = 1e3  # condition number up to which float32 is accurate enough


def condition_numbers(
    chosen: NDArray[np.floating], candidates: NDArray[np.floating]
) -> NDArray[np.float64]:
    """(m,) condition number of the chosen rows (j, k) with each candidate row (m, k) added."""
    m, k = candidates.shape
    stacked = np.empty((m, len(chosen) + 1, k))
    stacked[:, :-1] = chosen
    stacked[:, -1] = candidates
    values = np.linalg.svd(stacked, compute_uv=False)
    return np.asarray(values[:, 0] / np.maximum(values[:, -1], 1e-300))


@dataclass(frozen=True)
class ConditionBound:
    """chosen: (j, k) rows. vectors: (k, k) right singular vectors, ascending; poles: their squared
    singular values, ascending; outside: how many of the vectors lie outside the span of the chosen
    rows. These share the first pole, 0."""

    chosen: NDArray[np.float64]
    poles: NDArray[np.float64]
    vectors: NDArray[np.float64]
    outside: int

    @classmethod
    def of(cls, chosen: NDArray[np.floating]) -> ConditionBound:
        """For rows (j, k), j ≥ 1."""
        rows = np.asarray(chosen, np.float64)
        _, values, vectors = np.linalg.svd(rows)
        outside = max(0, rows.shape[1] - len(rows))
        poles: NDArray[np.float64] = np.square(values[::-1])
        if outside:
            poles = np.concatenate([[0.0], poles])
        return cls(rows, poles, np.ascontiguousarray(vectors[::-1]), outside)

    def extremes(
        self,
        candidates: NDArray[np.floating],
        extent: NDArray[np.floating] | None = None,
        rounds: int = 0,
        single: bool = False,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """((m,) lower bound on the largest singular value, (m,) upper bound on the smallest) of the
        chosen rows with each candidate row (m, k) added, or with any row whose components differ
        from the candidate's by at most ``extent`` (m, k).

        rounds: halvings of the interval that holds each singular value. single: compute in float32.
        """
        kind: type[np.floating] = np.float32 if single else np.float64
        largest, smallest = np.empty(len(candidates)), np.empty(len(candidates))
        for begin in range(0, len(candidates), ROWS_AT_ONCE):
            part = slice(begin, begin + ROWS_AT_ONCE)
            q = candidates[part].astype(kind, copy=False)
            e = None if extent is None else extent[part].astype(kind, copy=False)
            largest[part], smallest[part] = self._extremes(q, e, rounds)
        return largest, smallest

    def bounds(
        self, candidates: NDArray[np.floating], rounds: int = 0, single: bool = False
    ) -> NDArray[np.float64]:
        """(m,) lower bounds on the condition number with each candidate row (m, k).

        rounds: halvings of the intervals that hold the two singular values. single: compute in
        float32, valid for condition numbers up to SINGLE_PRECISION_LIMIT.
        """
        largest, smallest = self.extremes(candidates, rounds=rounds, single=single)
        margin = ROUNDING_32 if single else ROUNDING
        return largest / np.maximum(smallest, 1e-300) * (1 - margin)

    def possible(
        self,
        candidates: NDArray[np.floating],
        limit: float,
        extent: NDArray[np.floating] | None = None,
    ) -> NDArray[np.bool_]:
        """(m,) False where neither a candidate row (m, k) nor any row within ``extent`` (m, k) of
        it gives a condition number up to ``limit``: a weaker bound than bounds() in a fraction of
        its time.

        The smallest singular value is at most the norm of the rows times any unit vector in their
        span, here that of the candidate's part outside the span of the others. The largest only
        grows.
        """
        vectors = self.vectors[: max(self.outside, 1)].astype(candidates.dtype)
        need = self.poles[-1] / limit**2 * (1 - 2 * ROUNDING_32) - self.poles[0]
        if need <= 0:
            return np.ones(len(candidates), bool)
        high = np.abs(candidates @ vectors.T)
        if extent is not None:
            high += extent @ np.abs(vectors.T)
        return np.asarray(np.square(high).sum(axis=1) >= need)

    def smallest(
        self, candidates: NDArray[np.floating], limit: float = np.inf
    ) -> tuple[int, float] | None:
        """(index, condition number) of the candidate row (m, k) that gives the smallest one, the
        first where several are equal; None where none is below ``limit``."""
        contenders = np.arange(len(candidates))
        if np.isfinite(limit) and len(candidates) > BATCH:
            contenders = np.flatnonzero(self.possible(candidates, limit))
        bounds = np.full(len(candidates), np.inf)
        known = limit
        for rounds in HALVINGS:  # few candidates get the nearly exact bounds
            single = rounds == 0 and known <= SINGLE_PRECISION_LIMIT
            bounds[contenders] = self.bounds(candidates[contenders], rounds, single)
            contenders = contenders[bounds[contenders] <= known]
            if len(contenders) <= BATCH:
                break
            nearest = contenders[np.argpartition(bounds[contenders], FIRST_BATCH)[:FIRST_BATCH]]
            known = min(known, float(condition_numbers(self.chosen, candidates[nearest]).min()))
            contenders = contenders[bounds[contenders] <= known]
        contenders = contenders[np.argsort(bounds[contenders], kind="stable")]
        best, number = -1, limit
        for begin in range(0, len(contenders), BATCH):
            some = contenders[begin : begin + BATCH]
            if bounds[some[0]] > number:
                break
            some = np.sort(some)
            found = condition_numbers(self.chosen, candidates[some])
            place = int(found.argmin())
            better = found[place] < number
            if better or (found[place] == number and 0 <= some[place] < best):
                best, number = int(some[place]), float(found[place])
        return None if best < 0 else (best, number)

    def _extremes(
        self, q: NDArray[np.floating], extent: NDArray[np.floating] | None, rounds: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        # the smallest root grows with the first pole's weight and falls with the others'
        """extremes() for one block of candidates q (m, k), in the type of q."""
        vectors, poles = self.vectors.astype(q.dtype), self.poles.astype(q.dtype)
        low = high = np.abs(vectors @ q.T)
        first = max(self.outside, 1)
        if extent is not None:
            reach = np.abs(vectors) @ extent.T
            low, high = np.maximum(low - reach, 0), high[:first] + reach[:first]
        weight = np.square(low[first:])
        outside_squared = np.square(high[:first]).sum(axis=0)
        if len(poles) == 1:  # one component: one singular value
            return np.sqrt(poles[0] + np.square(low[0])), np.sqrt(poles[0] + outside_squared)
        gap = poles[1] - poles[0]
        rest = np.maximum(poles[2:] - poles[0], np.finfo(q.dtype).tiny)
        c = 1 + (1 / rest) @ weight[1:]
        root = _root(c, outside_squared, weight[0], gap)
        top = poles[-1] + weight[-1]
        if rounds:
            tiny = np.finfo(q.dtype).tiny
            away = np.concatenate([[gap], rest])[:, None]
            under = np.zeros_like(root)
            for _ in range(rounds):
                x = 0.5 * (under + root)
                above = 1 + (weight / np.maximum(away - x, tiny)).sum(axis=0) > outside_squared / x
                under, root = np.where(above, under, x), np.where(above, x, root)
            over = poles[-1] + np.square(q).sum(axis=1)
            for _ in range(rounds):
                x = 0.5 * (top + over) - poles[0]
                below = 1 - (weight / np.maximum(x - away, tiny)).sum(axis=0) < outside_squared / x
                top = np.where(below, x + poles[0], top)
                over = np.where(below, over, x + poles[0])
        return np.sqrt(top), np.sqrt(poles[0] + root)


def _root(
    c: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64], gap: float
) -> NDArray[np.float64]:
    """(m,) x in 0 … gap with c − first/x + second/(gap − x) = 0."""
    b = c * gap + first + second
    product = first * gap
    under = np.maximum(b * b - 4 * c * product, 0.0)
    return np.asarray(2 * product / (b + np.sqrt(under) + np.finfo(b.dtype).tiny))
