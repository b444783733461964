"""Show the view of the scene's camera as large as a viewport allows."""

from __future__ import annotations

import math

import bpy

MARGIN = 0.94  # of the free space


def show_camera_view(area: bpy.types.Area, scene: bpy.types.Scene) -> None:
    """Look through the scene's camera in a 3D viewport; the frame fits between its sidebars."""
    view = area.spaces.active.region_3d
    view.view_perspective = "CAMERA"
    sizes = {region.type: (region.width, region.height) for region in area.regions}
    width, height = sizes["WINDOW"]
    if width <= 1 or height <= 1:  # an area that was not drawn yet
        return
    margin = max(sizes.get("UI", (0, 0))[0], sizes.get("TOOLS", (0, 0))[0])
    free = MARGIN * max(width - 2 * margin, width / 4), MARGIN * height
    frame = scene.render.resolution_x, scene.render.resolution_y
    longer = min(f / n for f, n in zip(free, frame, strict=True)) * max(frame)
    share = longer / max(width, height)
    view.view_camera_zoom = _zoom(share)
    view.view_camera_offset = (0.0, 0.0)


def _zoom(share: float) -> float:
    """Blender's zoom value with which the frame takes a share of the longer side of the viewport
    (BKE_screen_view3d_zoom_to_fac)."""
    return 50.0 * (2.0 * math.sqrt(share) - math.sqrt(2.0))
