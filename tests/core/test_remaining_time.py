"""The remaining time that a job states, compared with what it turns out to be."""

from __future__ import annotations

from patina.core.concurrency.remaining_time import RemainingTime
from patina.core.jobs.fit_times import FitTimes, fit_seconds


def stated(steps: list[tuple[float, float]], at: list[float]) -> list[float]:
    """Remaining seconds stated at the times ``at``, updated each quarter of a second.

    steps: (seconds at which the fraction is reported, fraction), in order.
    """
    estimate, found = RemainingTime(), []
    for tick in range(int(4 * max(at)) + 1):
        fraction = max((f for s, f in steps if s <= tick / 4), default=0.0)
        left = estimate.update(tick / 4, fraction)
        if tick / 4 in at:
            assert left is not None
            found.append(left)
    return found


def test_steady_job_is_stated_exactly() -> None:
    steps = [(second, second / 60) for second in range(61)]
    for second, left in zip((6, 15, 30, 50), stated(steps, [6, 15, 30, 50]), strict=True):
        assert abs(left - (60 - second)) < 1e-9


def test_long_piece_without_progress_counts_down() -> None:
    """In a piece of 20 of 60 seconds; an extrapolation would state 80 s where 20 remain."""
    steps = [(s, s / 60) for s in range(21)] + [(s, s / 60) for s in range(40, 61)]
    before, after = stated(steps, [25, 39])
    assert 1 / 1.5 < before / 35 < 1.5 and 1 / 1.5 < after / 21 < 1.5


def test_stages_of_unequal_speed_stay_within_factor() -> None:
    """Fractions that are off by a third in each stage."""
    stages = [(0.1, 0.13), (0.35, 0.30), (0.7, 0.75), (1.0, 1.0)]  # (time, stated fraction), ends
    steps = []
    for k in range(241):
        time, low = k / 240, (0.0, 0.0)
        for high in stages:
            if time <= high[0]:
                part = (time - low[0]) / (high[0] - low[0])
                steps.append((60 * time, low[1] + part * (high[1] - low[1])))
                break
            low = high
    for second, left in zip((6, 15, 30), stated(steps, [6, 15, 30]), strict=True):
        assert 1 / 1.5 < left / (60 - second) < 1.5


def test_nothing_is_stated_too_early() -> None:
    estimate = RemainingTime()
    assert estimate.update(0.5, 0.3) is None and estimate.update(30.0, 0.001) is None


def test_shares_of_a_fit_add_up_and_follow_samples() -> None:
    times = FitTimes.of(8, 1_300_000, [250_000, 25_000], True)
    assert 0 < times.read < times.sampled
    (first, wide), (second, narrow) = times.material(0), times.material(1)
    assert first == times.sampled and abs(second - first - wide) < 1e-12
    assert 0.98 < second + narrow < 1 and wide > narrow
    assert fit_seconds(250_000) > 2 * fit_seconds(25_000)
    assert FitTimes.of(8, 1_300_000, [1000], False).fit_share(0) == 1.0
