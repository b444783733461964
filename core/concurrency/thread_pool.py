"""Threads of Python's for what numpy does outside its lock, and one for what BLAS does.

The matrices of a fit are small: BLAS's own threads wait for one another longer than they work.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager

from threadpoolctl import threadpool_limits

MOST = 4  # each holds its own piece of work in memory


def thread_count(threads: int | None) -> int:
    """How many threads; None: one a core, within reason."""
    return max(1, min(MOST, os.cpu_count() or 1)) if threads is None else max(1, threads)


@contextmanager
def thread_pool(count: int) -> Iterator[ThreadPoolExecutor | None]:
    """So many threads, None where one is enough: work is then done where it is asked for. In the
    end what waits is dropped, and what is at work ends unheard."""
    pool = ThreadPoolExecutor(count, "patina") if count > 1 else None
    try:
        yield pool
    finally:
        if pool is not None:
            pool.shutdown(wait=False, cancel_futures=True)


def single_threaded_blas() -> AbstractContextManager[object]:
    """Linear algebra on one thread meanwhile, in the whole process."""
    return threadpool_limits(1, user_api="blas")
