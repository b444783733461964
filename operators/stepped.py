"""Base class of operators with a long job. Scripts run the job to its end; in a window a timer
follows its progress, and ESC cancels it.

A job that does not use Blender runs in a child process: a timer tick never waits for it, and
Blender and the open file outlive its end, whatever ends it. Blender's data is changed on the timer
only, one piece per tick.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import bpy

from ..core.child_process import ChildJob
from ..core.concurrency.remaining_time import RemainingTime
from ..core.errors import PatinaError
from ..core.jobs import Job
from ..scene.session.child_processes import end_child, start_child
from ..scene.session.running_job import Running, running, set_running
from .report_errors import report_and_cancel

APPLYING = "Applying the result"  # progress text
WAIT = 0.02  # seconds that a script waits between two looks at a child process
REDRAW_INTERVAL = 0.25  # seconds between two updates of the progress bar


class Stepped:
    """Mixin for operators. Subclasses set self._job and self._scene in _start, and apply the result
    in _finish, where self._job is the job as it has run. A _finish that yields continues at the
    next tick; until it ends, no event is passed on."""

    TICK = 0.05
    IN_CHILD = True  # run the job in a child process; False: the job uses Blender
    PANEL = ""  # the stage that shows the progress
    CANCELLED = "Cancelled; nothing was changed."

    _timer: Any = None
    _started_at = _drawn_at = 0.0
    _job: Job | None = None
    _child: ChildJob | None = None
    _applying: Iterator[None] | None = None
    _time_left = RemainingTime()
    _scene: str = ""  # by name: a reference does not survive undo

    @classmethod
    def idle(cls, context: bpy.types.Context) -> bool:
        """Whether no other job runs. Sets the poll message if one does."""
        if running(context.scene) is not None:
            cls.poll_message_set("Another job is running; press ESC to cancel it")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run the job and apply its result in one call."""
        try:
            self._start(context)
            self._begin()
            while self._step():
                time.sleep(WAIT if self._child is not None else 0.0)
            for _ in self._finish(context) or ():
                pass
        except PatinaError as error:
            return report_and_cancel(self, error)
        finally:
            self._stop(context)
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Start the job; modal() continues it."""
        try:
            self._start(context)
            self._begin()
        except PatinaError as error:
            self._stop(context)
            return report_and_cancel(self, error)
        self._started_at, self._time_left = time.perf_counter(), RemainingTime()
        self._timer = context.window_manager.event_timer_add(self.TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        state = Running(self._scene, self.PANEL, "Starting", 0.0)  # the first step may take long
        set_running(state)
        _show_status(context, state)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Once per tick, check the job's progress or apply a piece of its result."""
        if self._applying is not None and event.type != "TIMER":
            return {"RUNNING_MODAL"}  # too late to cancel: the file has been changed
        if event.type == "ESC":
            self._stop(context)
            self.report({"WARNING"}, self.CANCELLED)
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            unfinished = self._advance(context)
        except PatinaError as error:
            self._stop(context)
            return report_and_cancel(self, error)
        except BaseException:
            self._stop(context)
            raise
        if unfinished:
            return {"RUNNING_MODAL"}
        self._stop(context)
        return {"FINISHED"}

    def _advance(self, context: bpy.types.Context) -> bool:
        """Do the work of one tick; False when everything is done."""
        if self._applying is None:
            if self._step():
                if (
                    time.perf_counter() - self._drawn_at > REDRAW_INTERVAL
                ):  # redrawing slows the job down
                    now = (self._child or self._job).now
                    state = Running(
                        self._scene, self.PANEL, now.stage, now.fraction, self._remaining()
                    )
                    set_running(state)
                    _show_status(context, state)
                    self._drawn_at = time.perf_counter()
                return True
            state = Running(self._scene, self.PANEL, APPLYING, 1.0)
            set_running(state)
            _show_status(context, state)
            self._applying = iter(self._finish(context) or ())
            return True
        return next(self._applying, self) is not self

    def _begin(self) -> None:
        """Start the child process."""
        if self.IN_CHILD:
            try:
                self._child = start_child(self._job)
            except OSError as error:
                raise PatinaError(f"No process can be started for this job ({error})") from error

    def _step(self) -> bool:
        """False when the job is done."""
        child = self._child
        if child is None:
            return self._job.step()
        if child.step():
            return True
        self._child, self._job = None, child.result
        return False

    def cancel(self, context: bpy.types.Context) -> None:
        """Called by Blender when it ends the operator (the window closes)."""
        self._stop(context)

    def _start(self, context: bpy.types.Context) -> None:
        raise NotImplementedError

    def _finish(self, context: bpy.types.Context) -> Iterator[None] | None:
        raise NotImplementedError

    def _remaining(self) -> float | None:
        """Remaining seconds; None if it is too early."""
        elapsed = time.perf_counter() - self._started_at
        return self._time_left.update(elapsed, (self._child or self._job).now.fraction)

    def _stop(self, context: bpy.types.Context) -> None:
        child, self._child = self._child, None
        if child is not None:
            end_child(child)
        elif self._job is not None:
            self._job.close()
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        set_running(None)
        _show_status(context, None)


def _show_status(context: bpy.types.Context, state: Running | None) -> None:
    """Show the progress in the status bar of the window; None restores the bar."""
    workspace = getattr(context, "workspace", None)
    if workspace is not None:
        text = None if state is None else f"{state.status} (ESC to cancel)"
        workspace.status_text_set(text)
