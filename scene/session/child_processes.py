"""The child processes of a Blender session: where their files are, and how they end."""

from __future__ import annotations

import atexit
from collections.abc import Generator
from pathlib import Path
from typing import TypeVar

import bpy

from ...core.basis import default_basis
from ...core.child_process import ChildJob
from ...core.child_process.object_files import delete_unused
from ...core.concurrency.job import Job, Step

AnyJob = TypeVar("AnyJob", bound=Job)
POLL_INTERVAL = 0.05  # seconds between two looks at children that were requested to end
_ending: list[ChildJob] = []


def start_child(job: AnyJob) -> ChildJob[AnyJob]:
    """Start a job in a child process. Its files are in Blender's temporary folder. Raises
    PatinaError and OSError."""
    _look()  # without a window no timer does it
    default_basis()  # loaded here: results refer to it, and reading them must not take long
    return ChildJob(job, _folder())


def in_child(job: AnyJob) -> Generator[Step, None, AnyJob]:
    """Run a job in a child process; yields its steps and returns it. Raises the errors of the
    job."""
    child = start_child(job)
    try:
        while child.step():
            yield child.now
        return child.result
    except GeneratorExit:  # the caller removes folders that the child writes to
        child.end()
        raise
    finally:
        end_child(child)


def in_child_of_window(job: AnyJob) -> Generator[Step, None, AnyJob]:
    """``in_child`` in a window; without one, where nothing else waits, the job runs here."""
    if not bpy.app.background:
        return (yield from in_child(job))
    while job.step():
        yield job.now
    return job


def end_child(child: ChildJob) -> None:
    """End a child. Blender does not wait for it."""
    child.request_end()
    _ending.append(child)
    if not bpy.app.background and not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=POLL_INTERVAL, persistent=True)


def end_all() -> None:
    """Wait until all children that were requested to end have ended."""
    while _ending:
        _ending.pop().end()


def _look() -> float | None:
    """Timer callback: see which children have ended. Returns the seconds until the next call."""
    _ending[:] = [child for child in _ending if not child.ended()]
    delete_unused()
    return POLL_INTERVAL if _ending else None


def _folder() -> Path:
    return Path(bpy.app.tempdir)


def register() -> None:
    """Wait for the children when Blender ends."""
    atexit.register(end_all)


def unregister() -> None:
    """Wait for the children, and remove the timer."""
    atexit.unregister(end_all)
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    end_all()
