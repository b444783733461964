"""What a child process runs: read a job, run it, report its progress, write its result.

It ends when its parent asks for it (SIGTERM, or by closing the pipe to standard input) and when its
parent ends in any other way, because the pipe is closed then too.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ..concurrency.job import Job, Step
from ..errors import PatinaError, system_error
from .messages import MessageWriter
from .object_files import read_object, write_object
from .parent_watch import CANCELLED, end_with_parent

MODULE = "core.child_process.child_main"
REQUEST, ANSWER = "request", "answer"  # names of the objects in the folder
REPORT_INTERVAL = 0.1  # seconds between two reports of progress
NICENESS = 5  # the job has all cores that Blender leaves
MEMORY_SCORE = 500  # of 1000: where memory runs out, Linux ends this process and not Blender
DONE, FAILED = 0, 1


class _Cancelled(BaseException):
    """The parent has asked for the end of the job, or has ended."""


def main(words: Sequence[str]) -> int:
    """Run the job that is stored in a folder. words: the path of the folder."""
    try:
        messages = MessageWriter(os.dup(1))
        os.dup2(2, 1)  # what a library prints must not get between the messages
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal reaches the parent too
        signal.signal(signal.SIGTERM, _cancel)
        end_with_parent()
        _give_way()
        return _answer(Path(words[0]), messages)
    except _Cancelled:
        return CANCELLED


def _answer(folder: Path, messages: MessageWriter) -> int:
    """Read the job, run it and write it; returns the exit code."""
    try:
        job: Job = read_object(folder / REQUEST, changes=True)
        signal.signal(signal.SIGTERM, _cancel)  # a library that was imported may have its own
        _run(job, messages)
        messages.write(stage="reading the result", fraction=1.0)
        write_object(folder / ANSWER, job)
        messages.write(done=True)
    except PatinaError as error:
        messages.write(error=str(error))
        return FAILED
    except MemoryError:
        messages.write(memory=True)
        return FAILED
    except OSError as error:
        messages.write(error=system_error(error))
        return FAILED
    except Exception as error:
        traceback.print_exc()
        messages.write(failure=f"{type(error).__name__}: {error}")
        return FAILED
    return DONE


def _run(job: Job, messages: MessageWriter) -> None:
    """Run the job to its end; the generators of a cancelled job remove their incomplete files."""
    reported = 0.0

    def report(step: Step) -> None:
        nonlocal reported
        now = time.monotonic()
        if now - reported >= REPORT_INTERVAL:
            messages.write(stage=step.stage, fraction=step.fraction)
            reported = now

    try:
        job.drain(report)
    finally:
        job.close()


def _cancel(*_: object) -> NoReturn:
    """Handler of SIGTERM."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise _Cancelled


def _give_way() -> None:
    """Give Blender priority in computing time and memory."""
    if sys.platform != "win32":
        os.nice(NICENESS)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(MEMORY_SCORE))
