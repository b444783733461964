"""A job that is dropped lets go of what it holds, and leaves BLAS as it was."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from threadpoolctl import threadpool_info

from patina.core.concurrency.job import Job, Step
from patina.core.concurrency.thread_pool import thread_count, thread_pool


class Counting(Job):
    """Three steps, and what became of them."""

    def __init__(self) -> None:
        super().__init__()
        self.let_go = False
        self.threads: set[int] = set()

    def run(self) -> Iterator[Step]:
        try:
            for k in range(3):
                self.threads = blas()
                yield Step("counting", k / 3)
        finally:
            self.let_go = True


def blas() -> set[int]:
    """Threads of every BLAS that is loaded."""
    np.linalg.inv(np.eye(3))
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


def test_dropped_in_the_middle() -> None:
    before, job = blas(), Counting()
    assert job.step() and not job.let_go
    assert job.threads == {1}
    job.close()
    assert job.let_go and blas() == before
    assert not job.step(), "nothing is left to do"


def test_drained() -> None:
    before, job = blas(), Counting()
    job.drain()
    assert job.let_go and blas() == before and job.now.fraction == 1.0
    job.close()  # of what is done there is nothing to drop


def test_never_begun() -> None:
    job = Counting()
    job.close()
    assert not job.step() and not job.let_go


def test_a_crew_of_one_is_none() -> None:
    assert (
        thread_count(0) == thread_count(1) == 1
        and thread_count(7) == 7
        and 1 <= thread_count(None) <= 4
    )
    with thread_pool(1) as pool:
        assert pool is None
    with thread_pool(2) as pool:
        assert pool is not None and pool.submit(lambda: 5).result() == 5
