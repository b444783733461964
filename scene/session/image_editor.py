"""An Image Editor to look and to paint in: the one that is open, or a half of the largest 3D
viewport."""

from __future__ import annotations

import bpy


def show_canvas(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image to paint on. Where there is no window, nothing has to be shown."""
    _show(context, image, "PAINT")


def show_image(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image to look at: where it is the first there, one pixel of it to one of the screen's
    if it fits."""
    area, new = _show(context, image, "VIEW")
    if area is None or not new:
        return
    region = next(r for r in area.regions if r.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.image.view_all(fit_view=True)
        if image.size[0] <= region.width and image.size[1] <= region.height:
            bpy.ops.image.view_zoom_ratio(ratio=1.0)


def width_to_show(context: bpy.types.Context) -> int | None:
    """Pixels across the editor that an image will be shown in; None without a window."""
    area, split = _place(context)
    if area is None:
        return None
    return area.width // 2 if split else area.width


def _place(context: bpy.types.Context) -> tuple[bpy.types.Area | None, bool]:
    """(the editor, False), or (the viewport that is to be split, True)."""
    screen = context.screen
    if screen is None or bpy.app.background:
        return None, False
    area = next((a for a in screen.areas if a.type == "IMAGE_EDITOR"), None)
    if area is not None:
        return area, False
    views = [a for a in screen.areas if a.type == "VIEW_3D"]
    return max(views, key=lambda a: a.width * a.height, default=None), True


def _show(
    context: bpy.types.Context, image: bpy.types.Image, mode: str
) -> tuple[bpy.types.Area | None, bool]:
    """(the editor, whether it showed something else before)."""
    area, split = _place(context)
    if area is None:
        return None, False
    if split:
        before = set(context.screen.areas)
        with context.temp_override(area=area, region=area.regions[-1]):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
        area = next(iter(set(context.screen.areas) - before))
        area.type = "IMAGE_EDITOR"
    space = area.spaces.active
    new = space.image != image
    space.image = image
    space.ui_mode = mode
    area.tag_redraw()
    return area, new
