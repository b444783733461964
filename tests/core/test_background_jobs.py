"""Work beside the job: values, results and errors arrive, and nobody waits long to be heard."""

from __future__ import annotations

import threading
import time
from collections.abc import Generator, Iterator

import pytest

from patina.core.concurrency.background import BackgroundJob, in_background, steps_in_background
from patina.core.concurrency.job import Job, Step
from patina.core.concurrency.steps import drained
from patina.core.errors import FitError


def slow_steps(seconds: float, seen: list[str]) -> Generator[float, None, str]:
    yield 0.0
    time.sleep(seconds)
    seen.append("first")
    yield 0.5
    seen.append("second")
    return "result"


def test_the_result_and_every_value_arrive_in_order() -> None:
    seen: list[str] = []
    values = []
    steps = steps_in_background(slow_steps(0.3, seen))
    while True:
        try:
            values.append(next(steps))
        except StopIteration as end:
            assert end.value == "result"
            break
    assert sorted(set(values)) == [0.0, 0.5] and values == sorted(values)
    assert values.count(0.0) > 3  # a yield every twentieth of a second
    assert seen == ["first", "second"]


def test_who_leaves_need_not_wait_and_the_rest_is_not_done() -> None:
    seen: list[str] = []
    steps = steps_in_background(slow_steps(0.5, seen))
    next(steps)
    next(steps)  # the half second has begun
    since = time.perf_counter()
    steps.close()
    assert time.perf_counter() - since < 0.3
    for thread in [t for t in threading.enumerate() if t.name.startswith("patina")]:
        thread.join(5)
    assert seen == ["first"]


def test_errors_pass_through() -> None:
    def fails() -> Generator[float, None, None]:
        yield 0.1
        raise FitError("too few samples")

    with pytest.raises(FitError, match="too few"):
        drained(steps_in_background(fails()))
    with pytest.raises(TimeoutError):  # the work's own, not the waiting's

        def late() -> None:
            raise TimeoutError

        drained(in_background(late, 0.0))


class Slow(Job):
    """A piece of a third of a second, then another."""

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
            self.done.append("let go")


def test_who_steps_a_job_alongside_never_waits() -> None:
    job, longest, steps = Slow(), 0.0, 0
    alongside = BackgroundJob(job)
    while True:
        since = time.perf_counter()
        going = alongside.step()
        longest = max(longest, time.perf_counter() - since)
        if not going:
            break
        steps += 1
        time.sleep(0.01)
    assert longest < 0.1 and steps > 5
    assert job.done == ["first", "second", "let go"]
    assert [stage.name for stage in job.stages] == ["first", "second"] and job.now.fraction == 1.0


def test_a_job_alongside_that_is_dropped_ends_after_its_piece() -> None:
    job = Slow()
    alongside = BackgroundJob(job)
    while job.now.stage != "first":
        time.sleep(0.01)
    since = time.perf_counter()
    alongside.close()
    assert time.perf_counter() - since < 0.2
    for thread in [t for t in threading.enumerate() if t.name.startswith("patina")]:
        thread.join(5)
    assert job.done == ["first", "let go"]


def test_errors_of_a_job_alongside_pass_through() -> None:
    class Fails(Slow):
        def run(self) -> Iterator[Step]:
            yield Step("first", 0.0)
            raise FitError("too few samples")

    alongside = BackgroundJob(Fails())
    with pytest.raises(FitError, match="too few"):
        while alongside.step():
            time.sleep(0.01)
