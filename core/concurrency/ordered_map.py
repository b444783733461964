"""Map a function over items on several threads, with the results in the order of the items."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
CHUNKS_AHEAD = 4  # chunks computed in advance: enough for MAX_THREADS, and little memory


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


def map_chunks(
    pool: ThreadPoolExecutor | None,
    function: Callable[[slice], Result],
    count: int,
    size: int,
) -> Generator[Result, None, None]:
    """Results in order for ``count`` rows, in slices of ``size``; one empty slice for no rows."""
    slices = (slice(begin, min(begin + size, count)) for begin in range(0, max(count, 1), size))
    yield from ordered_map(pool, function, slices, CHUNKS_AHEAD)
