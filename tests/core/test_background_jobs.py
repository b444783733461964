"""Background work: values, results and errors are delivered, and the caller never blocks long."""

from __future__ import annotations

import threading
import time
from collections.abc import Generator

import pytest

from patina.core.concurrency.background import in_background, steps_in_background
from patina.core.concurrency.steps import drained
from patina.core.errors import FitError


def slow_steps(seconds: float, completed: list[str]) -> Generator[float, None, str]:
    yield 0.0
    time.sleep(seconds)
    completed.append("first")
    yield 0.5
    completed.append("second")
    return "result"


def test_values_and_result_arrive_in_order() -> None:
    completed: list[str] = []
    values = []
    steps = steps_in_background(slow_steps(0.3, completed))
    while True:
        try:
            values.append(next(steps))
        except StopIteration as end:
            assert end.value == "result"
            break
    assert sorted(set(values)) == [0.0, 0.5] and values == sorted(values)
    assert values.count(0.0) > 3  # yields every 0.05 s
    assert completed == ["first", "second"]


def test_close_returns_at_once_and_stops_the_remaining_work() -> None:
    completed: list[str] = []
    steps = steps_in_background(slow_steps(0.5, completed))
    next(steps)
    next(steps)  # the 0.5 s sleep has begun
    start = time.perf_counter()
    steps.close()
    assert time.perf_counter() - start < 0.3
    for thread in [t for t in threading.enumerate() if t.name.startswith("patina")]:
        thread.join(5)
    assert completed == ["first"]


def test_errors_of_background_steps_are_raised() -> None:
    def fails() -> Generator[float, None, None]:
        yield 0.1
        raise FitError("too few samples")

    with pytest.raises(FitError, match="too few"):
        drained(steps_in_background(fails()))
    with pytest.raises(TimeoutError):  # raised by the work itself, not by the wait

        def raise_timeout() -> None:
            raise TimeoutError

        drained(in_background(raise_timeout, 0.0))
