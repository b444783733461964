"""Background work: values, results and errors are delivered, and the caller never blocks long."""

from __future__ import annotations

import threading
import time
from collections.abc import Generator, Iterator

import pytest

from patina.core.concurrency.background import BackgroundJob, in_background, steps_in_background
from patina.core.concurrency.job import Job, Step
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


class SlowJob(Job):
    """Two steps; the first one takes 0.3 s."""

    def __init__(self) -> None:
        super().__init__()
        self.done: list[str] = []

    def run(self) -> Iterator[Step]:
        try:
            yield Step("first", 0.0)
            time.sleep(0.3)
            self.done.append("first")
            yield Step("second", 0.5)
            self.done.append("second")
        finally:
            self.done.append("released")


def test_stepping_a_background_job_never_blocks() -> None:
    job, longest_step, steps = SlowJob(), 0.0, 0
    background = BackgroundJob(job)
    while True:
        start = time.perf_counter()
        is_running = background.step()
        longest_step = max(longest_step, time.perf_counter() - start)
        if not is_running:
            break
        steps += 1
        time.sleep(0.01)
    assert longest_step < 0.1 and steps > 5
    assert job.done == ["first", "second", "released"]
    assert [stage.name for stage in job.stages] == ["first", "second"] and job.now.fraction == 1.0


def test_closed_background_job_ends_after_its_current_step() -> None:
    job = SlowJob()
    background = BackgroundJob(job)
    while job.now.stage != "first":
        time.sleep(0.01)
    start = time.perf_counter()
    background.close()
    assert time.perf_counter() - start < 0.2
    for thread in [t for t in threading.enumerate() if t.name.startswith("patina")]:
        thread.join(5)
    assert job.done == ["first", "released"]


def test_errors_of_a_background_job_are_raised() -> None:
    class FailingJob(SlowJob):
        def run(self) -> Iterator[Step]:
            yield Step("first", 0.0)
            raise FitError("too few samples")

    background = BackgroundJob(FailingJob())
    with pytest.raises(FitError, match="too few"):
        while background.step():
            time.sleep(0.01)
