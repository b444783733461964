"""Work that cannot be cut into pieces (COLMAP's), in a thread that a job's steps look after."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

import pycolmap

from ..concurrency.job import Step
from ..errors import PatinaError

Result = TypeVar("Result")
PAUSE = 0.1  # seconds a step waits for news


class Cancelled(Exception):
    """The work was told to end."""


class Work:
    """What the thread shares with the job: it writes where it is, and asks whether to go on."""

    def __init__(self) -> None:
        self.token = pycolmap.CancellationToken()
        self.step = Step("starting", 0.0)

    def at(self, stage: str, fraction: float) -> None:
        """Say where the work is. Raises Cancelled where nobody wants it any more."""
        self.check()
        self.say(stage, fraction)

    def say(self, stage: str, fraction: float) -> None:
        """The same, from where nothing may be raised: within COLMAP."""
        self.step = Step(stage, fraction)

    def check(self) -> None:
        """Raise Cancelled where nobody wants the work any more."""
        if self.token.is_cancelled:
            raise Cancelled


class Background(Generic[Result]):
    """A function of Work in a thread of its own. Nothing in it may touch bpy."""

    def __init__(self, work: Callable[[Work], Result]) -> None:
        self._work, self._told = work, Work()
        self._result: Result | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="patina-solve")

    def steps(self) -> Iterator[Step]:
        """Start; yield where it is until it has ended. Closing the iterator ends the work soon,
        without waiting: the thread cleans up behind itself. Errors of the work pass through."""
        self._thread.start()
        try:
            while self._thread.is_alive():
                self._thread.join(PAUSE)
                yield self._told.step
        finally:
            self._told.token.cancel()
        if self._error is not None:
            raise self._error

    @property
    def result(self) -> Result:
        """What the function returned; only after the last step."""
        assert self._result is not None
        return self._result

    def _run(self) -> None:
        try:
            self._result = self._work(self._told)
        except Cancelled:
            pass
        except PatinaError as error:
            self._error = error
        except Exception as error:
            # what COLMAP throws when it is told to end, too; nobody listens then
            if not self._told.token.is_cancelled:
                self._error = error
