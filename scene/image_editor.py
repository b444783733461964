"""An Image Editor to look and to paint in: the one that is open, or a half of the largest 3D
viewport."""

from __future__ import annotations

import bpy


def show_canvas(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image to paint on. Where there is no window, nothing has to be shown."""
    _show(context, image, "PAINT")


def show_image(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image to look at, whole where it is the first one there."""
    area, new = _show(context, image, "VIEW")
    if area is None or not new:
        return
    region = next(r for r in area.regions if r.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.image.view_all(fit_view=True)


def _show(
    context: bpy.types.Context, image: bpy.types.Image, mode: str
) -> tuple[bpy.types.Area | None, bool]:
    """(the editor, whether it showed something else before)."""
    screen = context.screen
    if screen is None or bpy.app.background:
        return None, False
    area = next((a for a in screen.areas if a.type == "IMAGE_EDITOR"), None)
    if area is None:
        views = [a for a in screen.areas if a.type == "VIEW_3D"]
        if not views:
            return None, False
        widest = max(views, key=lambda a: a.width * a.height)
        before = set(screen.areas)
        with context.temp_override(area=widest, region=widest.regions[-1]):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
        area = next(iter(set(screen.areas) - before))
        area.type = "IMAGE_EDITOR"
    space = area.spaces.active
    new = space.image != image
    space.image = image
    space.ui_mode = mode
    area.tag_redraw()
    return area, new
