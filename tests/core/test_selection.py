"""The search for well-conditioned rows: its bounds hold, and a plain search is never better."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.angles import Angles
from patina.core.basis import default_basis
from patina.core.fit.condition_bound import ConditionBound, condition_numbers
from patina.core.fit.selection import choose
from tools.candidate_search.candidate_tree import angle_cells
from tools.candidate_search.cell_selection import choose_from_cells
from tools.plain_selection import choose_plainly

CASES = {
    "k": st.integers(1, 9), "n": st.integers(1, 10), "m": st.integers(12, 300),
    "spread": st.sampled_from([1.0, 30.0, 1000.0]), "seed": st.integers(0, 100_000),
}  # fmt: skip


def random_rows(k: int, m: int, spread: float, seed: int) -> np.ndarray:
    rows = np.random.default_rng(seed).normal(size=(m, k))
    return np.asarray(rows * np.geomspace(spread, 1, k))


def real_angles(m: int, seed: int = 0) -> Angles:
    u = np.random.default_rng(seed).random((3, m))
    return Angles(np.radians(60) * u[0] ** 1.5, np.radians(75) * u[1], np.pi * u[2])


@settings(max_examples=60, deadline=None)
@given(**CASES)
def test_condition_numbers_are_not_below_bound(k, n, m, spread, seed) -> None:
    rows = random_rows(k, m, spread, seed)
    bound = ConditionBound.of(rows[:n])
    exact = condition_numbers(rows[:n], rows)
    loose, sharp = bound.bounds(rows), bound.bounds(rows, rounds=2)
    good = exact < 1e6
    assert (loose[good] <= exact[good] * (1 + 1e-6)).all()
    assert (sharp[good] <= exact[good] * (1 + 1e-6)).all()
    assert (sharp[good] >= loose[good] * (1 - 1e-5)).all()


@settings(max_examples=40, deadline=None)
@given(**CASES)
def test_cell_bound_holds_for_whole_cell(k, n, m, spread, seed) -> None:
    rows = random_rows(k, m, spread, seed)
    rng = np.random.default_rng(seed + 1)
    extent = np.abs(rng.normal(size=rows.shape)) * rng.choice([0.01, 0.3, 2.0])
    largest, smallest = ConditionBound.of(rows[:n]).extremes(rows, extent)
    for _ in range(5):
        moved = rows + rng.uniform(-1, 1, rows.shape) * extent
        selected = np.broadcast_to(rows[:n], (m, min(n, m), k))
        values = np.linalg.svd(np.concatenate([selected, moved[:, None]], axis=1), compute_uv=False)
        assert (largest <= values[:, 0] * (1 + 1e-6)).all()
        assert (smallest >= values[:, -1] * (1 - 1e-6) - 1e-7 * spread).all()


@settings(max_examples=60, deadline=None)
@given(**CASES)
def test_search_is_not_worse_than_plain_search(k, n, m, spread, seed) -> None:
    rows = random_rows(k, m, spread, seed)
    plain = np.linalg.cond(rows[choose_plainly(rows, n, lambda selected: np.ones(m, bool))])
    quick = np.linalg.cond(rows[choose(rows, n)])
    many = np.linalg.cond(rows[choose_from_cells(rows, np.arange(m) // 5, n)])
    if plain < 1e6:  # beyond that no set is usable and the order is decided by rounding
        assert quick <= plain * (1 + 1e-6) and many <= plain * (1 + 1e-4)


@pytest.mark.parametrize("count", [6, 12])
def test_search_is_not_worse_on_rows_of_basis(count: int) -> None:
    angles = real_angles(3000)
    rows = default_basis().rows(angles, count)[1]
    plain = np.linalg.cond(rows[choose_plainly(rows, count, lambda selected: np.ones(3000, bool))])
    assert np.linalg.cond(rows[choose(rows, count)]) <= plain * (1 + 1e-4)
    many = choose_from_cells(rows, angle_cells(angles), count)
    assert len(set(many.tolist())) == count
    assert np.linalg.cond(rows[many]) <= plain * (1 + 1e-4)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 1000))
def test_constraints_and_fixed_row_are_kept_as_in_plain_search(seed: int) -> None:
    rows = random_rows(6, 200, 30.0, seed)
    order = np.random.default_rng(seed).random(200)

    def apart(selected: np.ndarray) -> np.ndarray:
        return (np.abs(order[:, None] - order[selected]) > 0.02).all(axis=1)

    plain, quick = choose_plainly(rows, 6, apart, fixed=5), choose(rows, 6, apart, fixed=5)
    assert (plain is None) == (quick is None)
    if quick is not None and plain is not None:
        assert 5 in quick and np.diff(np.sort(order[quick])).min() > 0.02
        assert np.linalg.cond(rows[quick]) <= np.linalg.cond(rows[plain]) * (1 + 1e-6)


def test_neighbouring_cells_share_larger_cell() -> None:
    """Indices increase with the leading bits of all three angles; near angles share a cell."""
    angles = real_angles(20_000)
    cells = angle_cells(angles)
    assert cells.min() >= 0
    nudged = Angles(*(np.asarray(a) + 1e-7 for a in angles))
    assert (angle_cells(nudged) == cells).mean() > 0.999
    for level, widest in ((0, 4.0), (6, 16.0), (12, 60.0)):
        for number in np.unique(cells >> level)[:200]:
            inside = np.degrees(np.asarray(angles.theta_d)[(cells >> level) == number])
            assert np.ptp(inside) < widest


def test_equal_input_gives_equal_selection() -> None:
    rows = random_rows(6, 5000, 30.0, 3)
    cells = np.arange(5000) // 7
    first = choose_from_cells(rows, cells, 6)
    assert np.array_equal(first, choose_from_cells(rows.copy(), cells.copy(), 6))
