"""Run a job in a process of its own, as its parent sees it: start, progress, result, end."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Generic, TypeVar

from ..concurrency.job import Job, Step
from ..errors import PatinaError
from . import child_main
from .messages import MessageReader
from .object_files import own_folder, read_object, write_object
from .python_command import python_command, python_environment

log = logging.getLogger(__name__)

AnyJob = TypeVar("AnyJob", bound=Job)
END_SECONDS = 0.6  # after which a child that was requested to end is killed
POLL_INTERVAL = 0.02  # seconds
MEMORY_ADVICE = "Close other programs, or use fewer or smaller photos or a smaller mesh"
LOWER_PRIORITY = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # otherwise Windows opens a console


class ChildJob(Generic[AnyJob]):
    """A job that runs in a child process. Its files lie in a new folder within ``parent``, which is
    deleted when the result is no longer in memory.

    now: the latest step; process_id: of the child. Raises PatinaError and OSError where no process
    can be started.
    """

    def __init__(self, job: AnyJob, parent: Path) -> None:
        self.now = Step("Starting", 0.0)
        self._folder = Path(tempfile.mkdtemp(prefix="job-", dir=parent))
        self._message: dict[str, Any] = {}
        self._result: AnyJob | None = None
        self._end_requested_at: float | None = None
        try:
            write_object(self._folder / child_main.REQUEST, job)
            temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(self._folder))
            self._process = subprocess.Popen(
                python_command(child_main.MODULE, str(self._folder)),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**python_environment(), **temporary},
                creationflags=NO_WINDOW | LOWER_PRIORITY,
            )
        except BaseException:
            own_folder(self._folder)
            raise
        assert self._process.stdout is not None
        self._messages = MessageReader(self._process.stdout.fileno())

    @property
    def process_id(self) -> int:
        """The identifier of the child process."""
        return self._process.pid

    def step(self) -> bool:
        """Read the progress; never waits. False when the job is done. Raises the PatinaError of the
        job, and one that names the reason where the process has ended in another way."""
        ended = self._process.poll() is not None  # before the last messages are read
        for message in self._messages.read():
            if "stage" in message:
                self.now = Step(message["stage"], message["fraction"])
            else:
                self._message = message
        if not ended:
            return True
        self._close_pipes()
        if self._message.get("done"):
            self._result = read_object(self._folder / child_main.ANSWER)
        own_folder(self._folder)
        if self._result is None:
            raise PatinaError(self._reason())
        return False

    @property
    def result(self) -> AnyJob:
        """The job after it has run. Only valid when step() has returned False."""
        if self._result is None:
            raise RuntimeError("the job is not done")
        return self._result

    def request_end(self) -> None:
        """Request the child to end; never waits. Call ended() until it is True, or end()."""
        if self._end_requested_at is None:
            self._end_requested_at = time.monotonic()
            self._close_pipes()  # the child ends when its standard input is closed
            if self._process.poll() is None:
                self._process.terminate()

    def ended(self) -> bool:
        """Whether a child that was requested to end has ended, and its files are removed. It is
        killed if this takes longer than END_SECONDS."""
        if self._process.poll() is None:
            if time.monotonic() - (self._end_requested_at or 0.0) > END_SECONDS:
                self._process.kill()
            return False
        own_folder(self._folder)
        return True

    def end(self) -> None:
        """End the child and wait for it, up to about END_SECONDS."""
        self.request_end()
        while not self.ended():
            time.sleep(POLL_INTERVAL)

    def _close_pipes(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def _reason(self) -> str:
        """Why there is no result, as a sentence."""
        message, code = self._message, self._process.returncode
        if "error" in message:
            return str(message["error"])
        if "memory" in message:
            return f"The memory was not sufficient; nothing was changed. {MEMORY_ADVICE}"
        if "failure" in message:
            return (
                f"An error in Patina ended the job ({message['failure']}); nothing was changed. "
                "Please report it, with the messages of the system console"
            )
        if code == -getattr(signal, "SIGKILL", 9) and sys.platform != "win32":
            return (
                "The system ended the process of this job (SIGKILL), most often because memory ran "
                f"out; nothing was changed. {MEMORY_ADVICE}"
            )
        return (
            f"The process of this job ended unexpectedly ({_exit_name(code)}); nothing was "
            f"changed. If memory ran out: {MEMORY_ADVICE[0].lower()}{MEMORY_ADVICE[1:]}"
        )


def _exit_name(code: int) -> str:
    try:
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"
    except ValueError:
        return f"signal {-code}"
