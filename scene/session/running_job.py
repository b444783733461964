"""The job that is running now, if any: not part of the .blend, which may be saved meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Running:
    """scene: the name of the scene it works for; panel: the stage that shows it; stage: of the job;
    fraction of the whole job done; left: seconds that it will still take, None unknown."""

    scene: str
    panel: str
    stage: str
    fraction: float
    left: float | None = None

    @property
    def said(self) -> str:
        """For the progress bar."""
        return self.stage if self.left is None else f"{self.stage}, {_time(self.left)} left"


_now: Running | None = None


def running(scene: bpy.types.Scene) -> Running | None:
    """What runs for this scene."""
    return _now if _now is not None and _now.scene == scene.name else None


def tell(state: Running | None) -> None:
    """Set or clear what runs, and have the sidebar of every 3D viewport show it: what stands in the
    viewport has not changed, and drawing that may take longer than a step of the job."""
    global _now
    _now = state
    redraw()


def redraw() -> None:
    """Every 3D viewport, with its sidebar."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in (r for r in area.regions if r.type == "UI"):
                    region.tag_redraw()


def _time(seconds: float) -> str:
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    return f"{round(seconds / 60)} min"
