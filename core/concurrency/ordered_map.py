"""A function over many things on some threads, its results in the order of the things."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Thing = TypeVar("Thing")
Result = TypeVar("Result")


def ordered_map(
    pool: ThreadPoolExecutor | None,
    function: Callable[[Thing], Result],
    things: Iterable[Thing],
    ahead: int,
) -> Generator[Result, None, None]:
    """Results one after the other, at most ``ahead`` of them made before they are asked for;
    without a pool each is made when it is asked for. Errors of the function pass through."""
    if pool is None:
        yield from map(function, things)
        return
    waiting: deque[Future[Result]] = deque()
    try:
        for thing in things:
            waiting.append(pool.submit(function, thing))
            if len(waiting) > ahead:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()
