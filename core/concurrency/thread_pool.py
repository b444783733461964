"""Python threads for numpy work that releases the GIL, and a single thread for BLAS.

The matrices of a fit are small: BLAS threads would wait for one another longer than they compute.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager

from threadpoolctl import threadpool_limits

MAX_THREADS = 4  # limits memory: each thread holds its own piece of work


def thread_count(threads: int | None) -> int:
    """Number of threads; None: one per core, at most MAX_THREADS."""
    return max(1, min(MAX_THREADS, os.cpu_count() or 1)) if threads is None else max(1, threads)


@contextmanager
def thread_pool(count: int) -> Iterator[ThreadPoolExecutor | None]:
    """A pool of so many threads, None for one thread: work is then done by the caller. At the end
    pending work is cancelled, and the results of running work are discarded."""
    pool = ThreadPoolExecutor(count, "patina") if count > 1 else None
    try:
        yield pool
    finally:
        if pool is not None:
            pool.shutdown(wait=False, cancel_futures=True)


def single_threaded_blas() -> AbstractContextManager[object]:
    """Context in which BLAS uses one thread, in the whole process."""
    return threadpool_limits(1, user_api="blas")
