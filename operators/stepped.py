"""Long work from the window: scripts drain the job, the window looks at it on a timer, ESC cancels.

Work that knows nothing of Blender goes on in a thread of its own, so that a tick of the timer never
waits for a piece of it. What is done to Blender's data is done on the timer, a piece a tick.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import bpy

from ..core.concurrency.background import BackgroundJob
from ..core.errors import PatinaError
from ..core.jobs import Job
from ..scene.session.running_job import Running, running, tell
from .report_errors import refuse

TAKING = "putting it into the file"
TELL = 0.25  # seconds from one drawing of the progress to the next
TOLD, SOON = 0.05, 2.0  # done, and seconds taken, before time left is told


class Stepped:
    """Subclasses set self._job and self._scene in _start, and take the result in _finish. A _finish
    that yields is gone on with a tick later; no event is passed on meanwhile."""

    TICK = 0.05
    ALONGSIDE = True  # False: the job touches Blender
    PANEL = ""  # the stage that shows how far it is
    CANCELLED = "Cancelled; nothing was changed"

    _timer: Any = None
    _since = _told = 0.0
    _job: Job | None = None
    _alongside: BackgroundJob | None = None
    _taking: Iterator[None] | None = None
    _scene: str = ""  # by name: a reference does not survive undo

    @classmethod
    def idle(cls, context: bpy.types.Context) -> bool:
        """False, with a reason, while something else runs."""
        if running(context.scene) is not None:
            cls.poll_message_set("Something is running; ESC stops it")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """All of it at once."""
        try:
            self._start(context)
            self._job.drain()
            for _ in self._finish(context) or ():
                pass
        except PatinaError as error:
            return refuse(self, error)
        finally:
            self._stop(context)
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Begin, and go on by modal()."""
        try:
            self._start(context)
        except PatinaError as error:
            self._stop(context)
            return refuse(self, error)
        self._since = time.perf_counter()
        self._timer = context.window_manager.event_timer_add(self.TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        tell(Running(self._scene, self.PANEL, "beginning", 0.0))  # the first step may be a long one
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Look how far it is, or take over a piece of the result, once a tick."""
        if self._taking is not None and event.type != "TIMER":
            return {"RUNNING_MODAL"}  # too late to leave the file as it was
        if event.type == "ESC":
            self._stop(context)
            self.report({"WARNING"}, self.CANCELLED)
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            going = self._goes_on(context)
        except PatinaError as error:
            self._stop(context)
            return refuse(self, error)
        except BaseException:
            self._stop(context)
            raise
        if going:
            return {"RUNNING_MODAL"}
        self._stop(context)
        return {"FINISHED"}

    def _goes_on(self, context: bpy.types.Context) -> bool:
        """A tick's worth of work; False when all is done."""
        if self._taking is None:
            if self._step():
                if time.perf_counter() - self._told > TELL:  # drawing takes from the job's time
                    now = self._job.now
                    tell(Running(self._scene, self.PANEL, now.stage, now.fraction, self._left()))
                    self._told = time.perf_counter()
                return True
            tell(Running(self._scene, self.PANEL, TAKING, 1.0))
            self._taking = iter(self._finish(context) or ())
            return True
        return next(self._taking, self) is not self

    def _step(self) -> bool:
        """False when the job is done."""
        if not self.ALONGSIDE:
            return self._job.step()
        self._alongside = self._alongside or BackgroundJob(self._job)
        return self._alongside.step()

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator (the window closes)."""
        self._stop(context)

    def _start(self, context: bpy.types.Context) -> None:
        raise NotImplementedError

    def _finish(self, context: bpy.types.Context) -> Iterator[None] | None:
        raise NotImplementedError

    def _left(self) -> float | None:
        """Seconds, as what is done took; None where too little is."""
        done, took = self._job.now.fraction, time.perf_counter() - self._since
        return took * (1 - done) / done if done > TOLD and took > SOON else None

    def _stop(self, context: bpy.types.Context) -> None:
        if self._alongside is not None:
            self._alongside.close()
        elif self._job is not None:
            self._job.close()
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        tell(None)
