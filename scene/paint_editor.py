"""An Image Editor to paint in: the one that is open, or a half of the largest 3D viewport."""

from __future__ import annotations

import bpy


def show_canvas(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image to paint on. Where there is no window, nothing has to be shown."""
    screen = context.screen
    if screen is None or bpy.app.background:
        return
    area = next((a for a in screen.areas if a.type == "IMAGE_EDITOR"), None)
    if area is None:
        views = [a for a in screen.areas if a.type == "VIEW_3D"]
        if not views:
            return
        widest = max(views, key=lambda a: a.width * a.height)
        before = set(screen.areas)
        with context.temp_override(area=widest, region=widest.regions[-1]):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
        area = next(iter(set(screen.areas) - before))
        area.type = "IMAGE_EDITOR"
    space = area.spaces.active
    space.image = image
    space.ui_mode = "PAINT"
    area.tag_redraw()
