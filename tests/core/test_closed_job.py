"""A closed job releases its resources and restores the number of BLAS threads."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from threadpoolctl import threadpool_info

from patina.core.concurrency.job import Job, Step
from patina.core.concurrency.thread_pool import thread_count, thread_pool


class CountingJob(Job):
    """A job of three steps that records whether it was cleaned up."""

    def __init__(self) -> None:
        super().__init__()
        self.released = False
        self.threads: set[int] = set()

    def run(self) -> Iterator[Step]:
        try:
            for k in range(3):
                self.threads = blas_threads()
                yield Step("counting", k / 3)
        finally:
            self.released = True


def blas_threads() -> set[int]:
    """The thread counts of all loaded BLAS libraries."""
    np.linalg.inv(np.eye(3))
    return {
        library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"
    }


def test_closing_a_running_job_releases_its_resources() -> None:
    before, job = blas_threads(), CountingJob()
    assert job.step() and not job.released
    assert job.threads == {1}
    job.close()
    assert job.released and blas_threads() == before
    assert not job.step(), "a closed job has no further steps"


def test_drained_job_is_finished_and_released() -> None:
    before, job = blas_threads(), CountingJob()
    job.drain()
    assert job.released and blas_threads() == before and job.now.fraction == 1.0
    job.close()  # closing a finished job does nothing


def test_closing_a_job_that_never_started() -> None:
    job = CountingJob()
    job.close()
    assert not job.step() and not job.released


def test_thread_count_and_pool_of_one_thread() -> None:
    assert (
        thread_count(0) == thread_count(1) == 1
        and thread_count(7) == 7
        and 1 <= thread_count(None) <= 4
    )
    with thread_pool(1) as pool:
        assert pool is None
    with thread_pool(2) as pool:
        assert pool is not None and pool.submit(lambda: 5).result() == 5
