"""Blender script: screenshots of the sidebar at its default width: dark and light theme, twice the
size, and in other languages. The .blend in OUT, a result of `fit` or `diagnose`, is opened.

blender --factory-startup --addons bl_ext.user_default.patina -P tools/window/looks.py -- OUT
(`.ci/real_blender.sh looks DIR OUT` runs it on a virtual screen.)
"""

from __future__ import annotations

import os
import subprocess
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy

OUT = Path(sys.argv[sys.argv.index("--") + 1])
LOOKS = {  # name → (scale of the interface, light theme, language)
    "dark": (1.0, False, "en_US"),
    "light": (1.0, True, "en_US"),
    "twice": (2.0, False, "en_US"),
    "german": (1.0, True, "de_DE"),
    "japanese": (1.0, False, "ja_JP"),
}
PAGES = 3  # screenshots of each look, further down
SCROLLS = 22  # steps between them
REDRAW = 1.5  # seconds after which a window has been redrawn


def area() -> bpy.types.Area:
    """The 3D viewport."""
    screen = bpy.context.window_manager.windows[0].screen
    return next(a for a in screen.areas if a.type == "VIEW_3D")


def sidebar() -> bpy.types.Region:
    """Its sidebar."""
    return next(r for r in area().regions if r.type == "UI")


def open_check() -> None:
    """Show the panel of the check open, before it is drawn for the first time."""
    panel = bpy.types.PATINA_PT_check
    bpy.utils.unregister_class(panel)
    panel.bl_options = set()
    bpy.utils.register_class(panel)


def use(scale: float, light: bool, language: str) -> None:
    """Set scale, theme and language."""
    view = bpy.context.preferences.view
    view.ui_scale = scale
    view.language = language
    view.use_translate_interface = view.use_translate_tooltips = language != "en_US"
    if light:
        folders = bpy.utils.preset_paths("interface_theme")
        theme = next(f for d in folders for f in Path(d).glob("*ight.xml"))
        bpy.ops.script.execute_preset(
            filepath=str(theme), menu_idname="USERPREF_MT_interface_theme_presets"
        )
    else:
        bpy.ops.preferences.reset_default_theme()


def scroll(steps: int) -> None:
    """Scroll the sidebar down, or up for negative steps."""
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area(), region=sidebar()):
        for _ in range(abs(steps)):
            (bpy.ops.view2d.scroll_down if steps > 0 else bpy.ops.view2d.scroll_up)()


def looks() -> Iterator[float]:
    """Take the screenshots; yields seconds to wait."""
    yield REDRAW
    blend = next(OUT.glob("*.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    yield 2 * REDRAW
    open_check()
    area().spaces.active.show_region_ui = True
    yield REDRAW
    sidebar().active_panel_category = "Patina"
    for name, look in LOOKS.items():
        use(*look)
        yield 2 * REDRAW
        for page in range(PAGES):
            file = OUT / f"{name}_{page}.png"
            subprocess.run(["import", "-window", "root", str(file)], check=True)
            scroll(SCROLLS)
            area().tag_redraw()
            yield REDRAW
        scroll(-PAGES * SCROLLS * 2)
        yield REDRAW


STEPS = looks()


def tick() -> float | None:
    """Run the next step; any exception ends Blender."""
    try:
        return next(STEPS)
    except StopIteration:
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        sys.stdout.flush()
        os._exit(1)


bpy.app.timers.register(tick, first_interval=3, persistent=True)
