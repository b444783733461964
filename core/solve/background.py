"""Run work that cannot be divided into steps (COLMAP's) in a thread, which a job's steps
monitor."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

import pycolmap

from ..concurrency.job import Step
from ..errors import PatinaError

Result = TypeVar("Result")
POLL_SECONDS = 0.1  # seconds that a step waits for the thread


class Cancelled(Exception):
    """The work was cancelled."""


class Work:
    """State that the thread shares with the job: progress, and whether to continue."""

    def __init__(self) -> None:
        self.token = pycolmap.CancellationToken()
        self.step = Step("starting", 0.0)

    def at(self, stage: str, fraction: float) -> None:
        """Report the stage and the fraction done. Raises Cancelled where the work was cancelled."""
        self.check()
        self.report(stage, fraction)

    def report(self, stage: str, fraction: float) -> None:
        """Report progress without raising, for callbacks inside COLMAP."""
        self.step = Step(stage, fraction)

    def check(self) -> None:
        """Raise Cancelled where the work was cancelled."""
        if self.token.is_cancelled:
            raise Cancelled


class Background(Generic[Result]):
    """Runs a function of Work in its own thread. The function must not use bpy."""

    def __init__(self, work: Callable[[Work], Result]) -> None:
        self._work, self._work_state = work, Work()
        self._result: Result | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="patina-solve")

    def steps(self) -> Iterator[Step]:
        """Start the thread and yield its progress until it ends. Closing the iterator cancels the
        work without waiting; the thread cleans up itself. Errors of the work are raised here."""
        self._thread.start()
        try:
            while self._thread.is_alive():
                self._thread.join(POLL_SECONDS)
                yield self._work_state.step
        finally:
            self._work_state.token.cancel()
        if self._error is not None:
            raise self._error

    @property
    def result(self) -> Result:
        """The function's return value; only valid after the last step."""
        assert self._result is not None
        return self._result

    def _run(self) -> None:
        try:
            self._result = self._work(self._work_state)
        except Cancelled:
            pass
        except PatinaError as error:
            self._error = error
        except Exception as error:
            # after a cancellation COLMAP raises as well; that error is ignored
            if not self._work_state.token.is_cancelled:
                self._error = error
