"""Blender script for docs/images/window.jpg: the demo capture, fitted, in a real window.

blender --factory-startup --addons bl_ext.user_default.patina -P tools/window_scene.py
(.ci/real_blender.sh picture DIR PNG does it on a virtual screen and photographs the window.)
"""

from pathlib import Path

import bpy

bpy.context.preferences.view.show_splash = False


def build() -> None:
    """Import, fit, stand behind the first photo, the sidebar at the tab."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    area.spaces.active.show_region_ui = True
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.patina.import_demo()
        bpy.ops.patina.fit()
        bpy.ops.patina.next_photo(step=0)
        bpy.ops.view3d.view_center_camera()
    area.spaces.active.shading.type = "MATERIAL"
    bpy.app.timers.register(show_tab, first_interval=3)  # tabs are known once they were drawn


def show_tab() -> None:
    """Of the sidebar, and say that a photograph may be taken."""
    areas = bpy.context.window_manager.windows[0].screen.areas
    area = next(a for a in areas if a.type == "VIEW_3D")
    next(r for r in area.regions if r.type == "UI").active_panel_category = "Patina"
    area.tag_redraw()
    Path("/tmp/window-ready").touch()


bpy.app.timers.register(build, first_interval=3)
