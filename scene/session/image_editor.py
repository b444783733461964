"""Show images in an Image Editor: an open one, or a new one in half of the largest 3D viewport."""

from __future__ import annotations

import bpy


def show_canvas(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image in Paint mode. Without a window nothing happens."""
    _show(context, image, "PAINT")


def show_image(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show an image in View mode. If the editor showed another image before, the zoom is set to one
    image pixel per screen pixel, or to fit if the image is larger."""
    area, new = _show(context, image, "VIEW")
    if area is None or not new:
        return
    region = next(r for r in area.regions if r.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.image.view_all(fit_view=True)
        if image.size[0] <= region.width and image.size[1] <= region.height:
            bpy.ops.image.view_zoom_ratio(ratio=1.0)


def width_to_show(context: bpy.types.Context) -> int | None:
    """Width in pixels of the editor that will show an image; None without a window."""
    area, split = _place(context)
    if area is None:
        return None
    return area.width // 2 if split else area.width


def _place(context: bpy.types.Context) -> tuple[bpy.types.Area | None, bool]:
    """(the editor, False), or (the viewport to split, True); (None, …) if there is neither."""
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
    """Show the image; returns (the editor, whether it showed something else before)."""
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
