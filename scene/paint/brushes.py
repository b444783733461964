"""Provide a brush if Blender has none: builds without the asset library have no brushes. An
existing brush of the user is kept."""

from __future__ import annotations

import bpy

from .paint_kinds import update_brushes

MODES = {
    "vertex_paint": ("VERTEX_PAINT", "VIEW_3D"),
    "image_paint": ("TEXTURE_PAINT", "IMAGE_EDITOR"),
}
SIZE = 25  # pixels
CONTEXT_DELAY = 0.2  # seconds until an area that was just opened has a context

_waiting: list[str] = []


def prepare_brush(context: bpy.types.Context, mode: str) -> None:
    """Set the brush of a mode ("vertex_paint" or "image_paint") to the active paint. In a window, a
    brush is created if there is none."""
    update_brushes(context)
    settings = getattr(context.tool_settings, mode)
    if bpy.app.background or settings is None or settings.brush is not None:
        return
    _waiting.append(mode)
    if not bpy.app.timers.is_registered(_make):
        bpy.app.timers.register(_make, first_interval=CONTEXT_DELAY)


def _make() -> None:
    while _waiting:
        kind, area_type = MODES[_waiting.pop()]
        name = f"Patina {kind.replace('_', ' ').title()}"
        brush = bpy.data.brushes.get(name)
        if brush is None:
            brush = bpy.data.brushes.new(name, mode=kind)
            brush.size, brush.strength, brush.curve_preset = SIZE, 1.0, "CONSTANT"
        brush.asset_mark()  # only assets can be activated
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
            brush.asset_clear()  # it stays active; saved files should not offer it as an asset
            break
        update_brushes(bpy.context)


def register() -> None:
    """Nothing to register: brushes are created on first use."""


def unregister() -> None:
    """Remove the timer and forget pending brushes."""
    _waiting.clear()
    if bpy.app.timers.is_registered(_make):
        bpy.app.timers.unregister(_make)
