"""A brush to paint with, where Blender has none: builds without its asset library have no brushes.
Where there is one, it is the artist's own."""

from __future__ import annotations

import bpy

from .paint_kinds import take_up

MODES = {
    "vertex_paint": ("VERTEX_PAINT", "VIEW_3D"),
    "image_paint": ("TEXTURE_PAINT", "IMAGE_EDITOR"),
}
SIZE = 25  # pixels
SOON = 0.2  # seconds: an area that was just opened has no context yet

_waiting: list[str] = []


def ready_to_paint(context: bpy.types.Context, mode: str) -> None:
    """The brush of "vertex_paint" or "image_paint" paints with the active paint; in a window a
    brush is made where there is none."""
    take_up(context)
    settings = getattr(context.tool_settings, mode)
    if bpy.app.background or settings is None or settings.brush is not None:
        return
    _waiting.append(mode)
    if not bpy.app.timers.is_registered(_make):
        bpy.app.timers.register(_make, first_interval=SOON)


def _make() -> None:
    while _waiting:
        kind, area_type = MODES[_waiting.pop()]
        name = f"Patina {kind.replace('_', ' ').title()}"
        brush = bpy.data.brushes.get(name)
        if brush is None:
            brush = bpy.data.brushes.new(name, mode=kind)
            brush.asset_mark()  # only assets can be picked
            brush.size, brush.strength, brush.curve_preset = SIZE, 1.0, "CONSTANT"
        for window in bpy.context.window_manager.windows:
            area = next((a for a in window.screen.areas if a.type == area_type), None)
            if area is None:
                continue
            region = next(r for r in area.regions if r.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                bpy.ops.brush.asset_activate(
                    asset_library_type="LOCAL",
                    asset_library_identifier="",
                    relative_asset_identifier=f"Brush/{name}",
                )
            break
        take_up(bpy.context)


def register() -> None:
    """Nothing, until somebody paints."""


def unregister() -> None:
    """No brush is waited for any more."""
    _waiting.clear()
    if bpy.app.timers.is_registered(_make):
        bpy.app.timers.unregister(_make)
