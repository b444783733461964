"""Work in a background thread while the job goes on yielding, so that it reacts to Esc at once,
however long a piece of work takes. A cancelled piece runs to its end, but its result is discarded.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor, wait
from typing import TypeVar

Value = TypeVar("Value")
Result = TypeVar("Result")

YIELD_INTERVAL = 0.05  # seconds


def in_background(work: Callable[[], Result], value: Value) -> Generator[Value, None, Result]:
    """The result of ``work``; yields ``value`` while it runs. Errors of the work are raised."""
    pool = ThreadPoolExecutor(1, "patina")
    try:
        future = pool.submit(work)
        while wait([future], YIELD_INTERVAL).not_done:
            yield value
        return future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def steps_in_background(
    steps: Generator[float, None, Result],
) -> Generator[float, None, Result]:
    """The fractions and the result of ``steps``; the latest fraction is yielded repeatedly while
    the next step runs."""
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
