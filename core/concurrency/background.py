"""Work in a thread of its own while the job goes on yielding: ESC is heard within a moment, however
long a piece of the work takes. What is dropped ends its piece unheard, and touches nothing."""

from __future__ import annotations

from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor, wait
from typing import TypeVar

from .job import Job

Value = TypeVar("Value")
Result = TypeVar("Result")

MOMENT = 0.05  # seconds between yields


def in_background(work: Callable[[], Result], value: Value) -> Generator[Value, None, Result]:
    """What ``work`` returns; yields ``value`` while it goes on. Errors of the work pass through."""
    pool = ThreadPoolExecutor(1, "patina")
    try:
        future = pool.submit(work)
        while wait([future], MOMENT).not_done:
            yield value
        return future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def steps_in_background(
    steps: Generator[float, None, Result],
) -> Generator[float, None, Result]:
    """The fractions and the result of ``steps``; the latest fraction again and again while the next
    is on its way."""
    done = 0.0

    def following() -> tuple[float, None] | tuple[None, Result]:
        try:
            return next(steps), None
        except StopIteration as end:
            return None, end.value

    while True:
        fraction, result = yield from in_background(following, done)
        if fraction is None:
            return result  # type: ignore[return-value]
        done = fraction
        yield done


class BackgroundJob:
    """A job in a thread of its own: who steps it never waits. Not for a job that touches what
    belongs to another thread."""

    def __init__(self, job: Job) -> None:
        self.job = job
        self._pool = ThreadPoolExecutor(1, "patina")
        self._dropped = False
        self._going = self._pool.submit(self._drive)

    def step(self) -> bool:
        """False when the job is done. Errors of the work pass through."""
        if not self._going.done():
            return True
        self._going.result()
        return False

    def close(self) -> None:
        """What is under way ends unheard; then the job lets go of everything it holds."""
        self._dropped = True
        self._pool.shutdown(wait=False)

    def _drive(self) -> None:
        try:
            while not self._dropped and self.job.step():
                pass
        finally:
            self.job.close()
