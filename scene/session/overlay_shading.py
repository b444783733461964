"""A temporary shading of the 3D viewports that shows a colour attribute of the mesh, and the way
back: the earlier shading is stored on the screen, which undo does not change and the .blend keeps.
"""

from __future__ import annotations

import json
from typing import Any

import bpy

from ..property_keys import OVERLAY

SHADING = ("SOLID", "VERTEX", "FLAT")  # type, colour type and light that show a colour attribute


def enter_overlay(shown: str, mesh: bpy.types.Object) -> None:
    """Show the active colour attribute of the mesh in every 3D viewport.

    shown: identifier of what is shown. The shading and the active attribute before the first call
    are stored until leave_overlay. Call this before the active attribute is changed.
    """
    mesh[OVERLAY] = shown  # undo takes this mark away, and leaves the screen as it is
    for screen in _screens_in_windows():
        views = _viewports(screen)
        if not views:
            continue
        record = _record(screen)
        if record is None:
            attributes = mesh.data.color_attributes
            record = {
                "mesh": mesh.name,
                "colour": attributes.active_color.name if attributes.active_color else "",
                "views": [[str(view.as_pointer()), *_shading(view)] for view in views],
            }
        screen[OVERLAY] = json.dumps({**record, "shown": shown})
        for view in views:
            _set_shading(view, SHADING)


def leave_overlay() -> bool:
    """Restore the shading and the active colour attribute. A viewport whose shading the user has
    changed meanwhile keeps it. False if there was no overlay."""
    left = False
    for screen in bpy.data.screens:
        record = _record(screen)
        if record is None:
            continue
        left = True
        del screen[OVERLAY]
        stored = {pointer: shading for pointer, *shading in record["views"]}
        first = next(iter(stored.values()))
        for view in _viewports(screen):
            if _shading(view) == SHADING:  # a viewport that was split off has no record of its own
                _set_shading(view, stored.get(str(view.as_pointer()), first))
            view.tag_redraw()
        _restore_colour(record)
    return left


def overlay_shown(screen: bpy.types.Screen | None = None) -> str:
    """The identifier of what the overlay shows, "" if there is no overlay or if the user has left
    it by another shading. screen: only there; None for any."""
    for one in bpy.data.screens if screen is None else (screen,):
        record = _record(one)
        if record is not None and any(shows_overlay(view) for view in _viewports(one)):
            return str(record["shown"])
    return ""


def overlay_undone() -> bool:
    """Whether no mesh has the mark of the overlay any more: it was undone, or another file was
    loaded."""
    return not any(OVERLAY in o for scene in bpy.data.scenes for o in scene.objects)


def shows_overlay(view: bpy.types.Area) -> bool:
    """Whether the shading of a viewport is that of the overlay."""
    return _shading(view) == SHADING


def _screens_in_windows() -> list[bpy.types.Screen]:
    windows = bpy.context.window_manager.windows if bpy.context.window_manager else ()
    return list({window.screen.name: window.screen for window in windows}.values())


def _viewports(screen: bpy.types.Screen) -> list[bpy.types.Area]:
    return [area for area in screen.areas if area.type == "VIEW_3D"]


def _shading(view: bpy.types.Area) -> tuple[str, str, str]:
    shading = view.spaces.active.shading
    return shading.type, shading.color_type, shading.light


def _set_shading(view: bpy.types.Area, values: tuple[str, str, str] | list[str]) -> None:
    shading = view.spaces.active.shading
    shading.type = "SOLID"  # the other two are settings of the solid shading
    shading.color_type, shading.light = values[1], values[2]
    shading.type = values[0]


def _record(screen: bpy.types.Screen) -> dict[str, Any] | None:
    """The record of a screen; None if there is none, or none that can be read."""
    try:
        found = json.loads(screen.get(OVERLAY, ""))
        valid = isinstance(found["shown"], str) and all(len(v) == 4 for v in found["views"])
    except (ValueError, TypeError, KeyError):
        return None
    return found if valid and found["views"] else None


def _restore_colour(record: dict[str, Any]) -> None:
    mesh = bpy.data.objects.get(str(record.get("mesh", "")))
    if mesh is None or mesh.type != "MESH":
        return
    mesh.pop(OVERLAY, None)
    earlier = mesh.data.color_attributes.get(str(record.get("colour", "")))
    if earlier is not None:
        mesh.data.color_attributes.active_color = earlier
