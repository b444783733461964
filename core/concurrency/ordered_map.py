"""Map a function over items on several threads, with the results in the order of the items."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def ordered_map(
    pool: ThreadPoolExecutor | None,
    function: Callable[[Item], Result],
    things: Iterable[Item],
    ahead: int,
) -> Generator[Result, None, None]:
    """Results in order, at most ``ahead`` of them computed in advance; without a pool each is
    computed when it is requested. Errors of the function are raised."""
    if pool is None:
        yield from map(function, things)
        return
    pending: deque[Future[Result]] = deque()
    try:
        for item in things:
            pending.append(pool.submit(function, item))
            if len(pending) > ahead:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()
    finally:
        for future in pending:
            future.cancel()
