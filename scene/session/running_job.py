"""The running job, if any. It is not stored in the .blend, which may be saved meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Running:
    """State of the running job.

    scene: name of its scene; panel: the stage that shows the progress; stage: step of the job;
    fraction: done, 0–1; left: remaining seconds, None if unknown.
    """

    scene: str
    panel: str
    stage: str
    fraction: float
    left: float | None = None

    @property
    def text(self) -> str:
        """Text of the progress bar."""
        return self.stage if self.left is None else f"{self.stage}, {_time(self.left)} left"

    @property
    def status(self) -> str:
        """Text of the status bar."""
        return f"Patina: {100 * self.fraction:.0f} %, {self.text}"


_now: Running | None = None


def running(scene: bpy.types.Scene) -> Running | None:
    """The job that runs for this scene, or None."""
    return _now if _now is not None and _now.scene == scene.name else None


def set_running(state: Running | None) -> None:
    """Set or clear the running job, and redraw the sidebars of all 3D viewports. The viewports
    themselves are not redrawn, which could take longer than a step of the job."""
    global _now
    _now = state
    redraw()


def redraw() -> None:
    """Redraw the sidebar of every 3D viewport."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in (r for r in area.regions if r.type == "UI"):
                    region.tag_redraw()


def _time(seconds: float) -> str:
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    return f"{round(seconds / 60)} min"
