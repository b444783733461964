"""The fit that is running now, if any: not part of the .blend, which may be saved meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Running:
    """scene: the name of the scene it works for; stage; fraction of the whole job done."""

    scene: str
    stage: str
    fraction: float


_now: Running | None = None


def running(scene: bpy.types.Scene) -> Running | None:
    """What runs for this scene."""
    return _now if _now is not None and _now.scene == scene.name else None


def tell(state: Running | None) -> None:
    """Set or clear what runs, and have every 3D viewport show it."""
    global _now
    _now = state
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
