"""The condition number of some rows and one more, bounded from below without singular values.

With the rows' singular values s and right singular vectors V, the squared singular values of the
rows and a further one q are the roots of 1 + Σ zᵢ² / (sᵢ² − λ) = 0, z = Vᵀ q, with a pole at 0 for
what of q lies outside the rows' span (Golub 1973, "Some modified matrix eigenvalue problems"). The
smallest root lies between the two smallest poles. Evaluating the other poles' terms at the smallest
pole makes the sum too small, so the root of the quadratic that is left lies above the true one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

AT_ONCE = 1 << 14  # rows whose products stay in the processor's cache
FIRST, BATCH = 16, 32  # condition numbers computed at a time
ROUNDING = 1e-6  # that a bound is lowered by: it must not exclude for rounding


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
    """chosen: (j, k) rows. vectors: (k, k) right singular vectors, ascending; poles: ascending
    squared singular values to them; outside: how many of the vectors lie outside the chosen rows'
    span: they share the first pole, 0."""

    chosen: NDArray[np.float64]
    poles: NDArray[np.float64]
    vectors: NDArray[np.float64]
    outside: int

    @classmethod
    def of(cls, chosen: NDArray[np.floating]) -> ConditionBound:
        """For rows (j, k), at least one."""
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
        """((m,) largest singular value, not above the true one, (m,) smallest, not below) of the
        chosen rows with each candidate row (m, k) added, or with any row whose components differ
        from the candidate's by no more than ``extent`` (m, k). single: in float32."""
        kind: type[np.floating] = np.float32 if single else np.float64
        largest, smallest = np.empty(len(candidates)), np.empty(len(candidates))
        for begin in range(0, len(candidates), AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            q = candidates[part].astype(kind, copy=False)
            e = None if extent is None else extent[part].astype(kind, copy=False)
            largest[part], smallest[part] = self._extremes(q, e, rounds)
        return largest, smallest

    def bounds(self, candidates: NDArray[np.floating], rounds: int = 0) -> NDArray[np.float64]:
        """(m,) no condition number with a candidate row (m, k) is smaller. rounds: how often the
        bound is sharpened, each for more time than the first."""
        largest, smallest = self.extremes(candidates, rounds=rounds)
        return largest / np.maximum(smallest, 1e-300) * (1 - ROUNDING)

    def smallest(
        self, candidates: NDArray[np.floating], limit: float = np.inf
    ) -> tuple[int, float] | None:
        """(place, condition number) of the candidate row (m, k) for which it is least, the first of
        them where several are equal; None where it is for none below ``limit``."""
        bounds = self.bounds(candidates)
        if not np.isfinite(limit) and len(bounds) > BATCH:
            nearest = np.argpartition(bounds, FIRST)[:FIRST]
            known = float(condition_numbers(self.chosen, candidates[nearest]).min())
        else:
            known = limit
        contenders = np.flatnonzero(bounds <= known)
        if len(contenders) > BATCH:  # nearly exact, for few
            bounds[contenders] = self.bounds(candidates[contenders], rounds=2)
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
        vectors, poles = self.vectors.astype(q.dtype), self.poles.astype(q.dtype)
        low = high = np.abs(vectors @ q.T)
        first = max(self.outside, 1)
        if extent is not None:
            reach = np.abs(vectors) @ extent.T
            low, high = np.maximum(low - reach, 0), high[:first] + reach[:first]
        weight = np.square(low[first:])
        sure = np.square(high[:first]).sum(axis=0)
        if len(poles) == 1:  # one component: one singular value
            return np.sqrt(poles[0] + np.square(low[0])), np.sqrt(poles[0] + sure)
        gap = poles[1] - poles[0]
        rest = np.maximum(poles[2:] - poles[0], np.finfo(q.dtype).tiny)
        c = 1 + (1 / rest) @ weight[1:]
        root = _root(c, sure, weight[0], gap)
        for _ in range(2 * rounds):  # from above and from below in turn
            terms = weight[1:] / np.maximum(rest[:, None] - root, np.finfo(q.dtype).tiny)
            root = _root(1 + terms.sum(axis=0), sure, weight[0], gap)
        top = poles[-1] + weight[-1]
        if rounds:  # the largest root: what follows from an upper bound lies below it
            over = poles[-1] + np.square(q).sum(axis=1)
            for _ in range(rounds):
                beyond = over[None] - poles[1:-1, None]
                c = 1 - (weight[:-1] / np.maximum(beyond, 1e-300)).sum(axis=0) - sure / over
                top = np.maximum(top, poles[-1] + weight[-1] / np.maximum(c, 1e-300))
                beyond = top[None] - poles[1:-1, None]
                c = 1 - (weight[:-1] / np.maximum(beyond, 1e-300)).sum(axis=0) - sure / top
                over = np.where(c > 0, np.minimum(over, poles[-1] + weight[-1] / c), over)
        return np.sqrt(top), np.sqrt(poles[0] + root)


def _root(
    c: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64], gap: float
) -> NDArray[np.float64]:
    """(m,) x in 0 … gap with c − first/x + second/(gap − x) = 0."""
    b = c * gap + first + second
    product = first * gap
    under = np.maximum(b * b - 4 * c * product, 0.0)
    return np.asarray(2 * product / (b + np.sqrt(under) + np.finfo(b.dtype).tiny))
