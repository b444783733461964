"""Stepped jobs, the same code for Blender and the command line: a job is stepped, reports progress
and can be cancelled."""

from __future__ import annotations

import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from .thread_pool import single_threaded_blas

R = TypeVar("R")


@dataclass(frozen=True)
class Stage:
    """Time and memory of one finished stage. peak_mb: peak memory of the process so far, MiB (None
    where the system does not report it)."""

    name: str
    seconds: float
    peak_mb: float | None


@dataclass(frozen=True)
class Step:
    """What the job does next: name of the stage and fraction of the WHOLE job done."""

    stage: str
    fraction: float


class Job(ABC):
    """A job in steps: subclasses yield a Step before each piece of work in run()."""

    def __init__(self) -> None:
        self.stages: list[Stage] = []
        self.now = Step("", 0.0)
        self._steps: Iterator[Step] | None = None
        self._since = time.perf_counter()

    @abstractmethod
    def run(self) -> Iterator[Step]:
        """The work, divided by yields."""

    def step(self) -> bool:
        """Do one piece of work; False when the job is done. Errors of the work are raised."""
        if self._steps is None:
            self._steps, self._since = self._run(), time.perf_counter()
        following = next(self._steps, None)
        if following is None or following.stage != self.now.stage:
            self._close_stage()
        self.now = following or Step("done", 1.0)
        return following is not None

    def drain(self, report: Callable[[Step], None] = lambda step: None) -> None:
        """Run to the end; report is called after each step."""
        while self.step():
            report(self.now)

    def close(self) -> None:
        """Cancel the job and release its resources."""
        steps, self._steps = self._steps, iter(())
        if isinstance(steps, Generator):
            steps.close()

    def __getstate__(self) -> dict[str, Any]:
        """State for another process, where the job starts from its beginning or has ended."""
        return {**vars(self), "_steps": None}

    def _run(self) -> Iterator[Step]:
        """run() with single-threaded BLAS."""
        with single_threaded_blas():
            yield from self.run()

    def _close_stage(self) -> None:
        """Record time and memory of the stage that ended."""
        moment = time.perf_counter()
        if self.now.stage:
            self.stages.append(Stage(self.now.stage, moment - self._since, peak_memory()))
        self._since = moment


def finished(result: R | None) -> R:
    """The result of a job that ran to its end."""
    if result is None:  # pragma: no cover - drain raises or finishes
        raise RuntimeError("the job ended without a result")
    return result


def peak_memory() -> float | None:
    """Peak resident memory of this process, MiB; None on Windows."""
    try:
        import resource  # not on Windows
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)
