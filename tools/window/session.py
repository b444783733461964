"""Blender script: an artist's session in a real window, from an empty file to finished materials of
the demo capture, with a screenshot of each stage. Strokes are drags of a real mouse (xdotool).

blender --factory-startup --addons bl_ext.user_default.patina -P tools/window/session.py -- OUT
(`.ci/real_blender.sh session DIR OUT` runs it on a virtual screen, and fails if it fails.)
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

OUT = Path(sys.argv[sys.argv.index("--") + 1])
PACKAGE = "bl_ext.user_default.patina"
STAGES = ["scan", "photos", "masks", "fit", "check", "material"]
HEADER, FIRST = 25, 18  # pixels: between headers of closed panels; from the top to the first header
TIMEOUT = 1500  # seconds for the session (real_blender.sh ends it soon after)
REDRAW_DELAY = 2.0  # seconds after which a window has been redrawn
found: dict[str, object] = {}
drawn: set[str] = set()  # stages whose panels were open at the last redraw of the sidebar


def window() -> bpy.types.Window:
    """Return the only window."""
    return bpy.context.window_manager.windows[0]


def area_of(kind: str) -> bpy.types.Area:
    """Return the first area of a type."""
    return next(a for a in window().screen.areas if a.type == kind)


def region_of(area: bpy.types.Area, kind: str = "WINDOW") -> bpy.types.Region:
    """Return the main region of an area, or its sidebar ("UI")."""
    return next(r for r in area.regions if r.type == kind)


def press(operator: str, how: str = "EXEC_DEFAULT", **settings: object) -> None:
    """Call an operator as its button does."""
    area = area_of("VIEW_3D")
    module_name, name = operator.split(".")
    with bpy.context.temp_override(window=window(), area=area, region=region_of(area)):
        outcome = getattr(getattr(bpy.ops, module_name), name)(how, **settings)
    assert outcome & {"FINISHED", "RUNNING_MODAL"}, (operator, outcome)


def part(name: str):
    """Return a module of the installed extension."""
    return importlib.import_module(f"{PACKAGE}.{name}")


def photograph(name: str) -> None:
    """Save a screenshot; that of Blender is black without a graphics card."""
    subprocess.run(["import", "-window", "root", str(OUT / f"{name}.png")], check=True)


def on_screen(region: bpy.types.Region, x: float, y: float) -> tuple[int, int]:
    """Convert a position in a region to screen coordinates (origin at the top left)."""
    return round(region.x + x), round(window().height - (region.y + y))


def mouse(*words: object) -> None:
    """Run a mouse action in the background."""
    arguments = [str(word) for word in words]
    subprocess.Popen(["xdotool", *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def drag(places: list[tuple[int, int]]) -> float:
    """Drag the mouse along the positions; return the duration in seconds."""
    words: list[object] = ["mousemove", *places[0], "sleep", 0.4, "mousedown", 1, "sleep", 0.2]
    for place in places[1:]:
        words += ["mousemove", *place, "sleep", 0.05]
    mouse(*words, "sleep", 0.3, "mouseup", 1)
    return 3.0 + 0.06 * len(places)


def open_panel(stage: str) -> Iterator[float]:
    """Click headers until only this panel is open, checking after each click what was drawn."""
    area = area_of("VIEW_3D")
    region, shading = region_of(area, "UI"), area.spaces.active.shading
    look, shading.type = shading.type, "SOLID"  # a slow viewport would delay the clicks
    for _ in range(12):
        drawn.clear()
        area.tag_redraw()
        yield REDRAW_DELAY
        if drawn == {stage}:
            break
        # headers above the contents of the topmost open panel do not move
        number = STAGES.index(min(drawn or {stage}, key=STAGES.index))
        x, y = on_screen(region, 90, region.height - FIRST - HEADER * number)
        # a region only accepts a click after the mouse has entered it
        mouse("mousemove", x - 5, y, "sleep", 0.4, "mousemove", x, y, "sleep", 0.4, "click", 1)
        yield 1.5
    else:
        raise AssertionError(f"the panel of {stage} did not open: {drawn}")
    shading.type = look
    yield REDRAW_DELAY


def until_done() -> Iterator[float]:
    """Wait until the running job ends."""
    running = part("scene.session.running_job").running
    yield REDRAW_DELAY
    while running(bpy.context.scene) is not None:
        yield 0.5


def note_ticks() -> None:
    """Record the longest tick of each stage in seconds, during which Blender is blocked."""
    stepped = part("operators.stepped").Stepped
    plain, longest = stepped.modal, found.setdefault("longest tick", {})

    def timed(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:  # type: ignore[no-untyped-def]
        since = time.perf_counter()
        answer = plain(self, context, event)
        took = round(time.perf_counter() - since, 3)
        longest[self.PANEL] = max(took, longest.get(self.PANEL, 0.0))  # type: ignore[attr-defined,index]
        return answer

    stepped.modal = timed


def begin() -> Iterator[float]:
    """Start with an empty file and show the tab in the sidebar."""
    note_ticks()
    bpy.context.preferences.view.show_splash = False
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    area = area_of("VIEW_3D")
    area.spaces.active.show_region_ui = True
    yield REDRAW_DELAY  # tabs exist after the first redraw
    region_of(area, "UI").active_panel_category = "Patina"
    area.tag_redraw()
    mouse(
        "mousemove", 700, 12, "sleep", 0.3, "click", 1
    )  # the first click only activates the window
    yield REDRAW_DELAY
    photograph("1_empty")


def scan_and_photos() -> Iterator[float]:
    """Import the demo capture and view a lit photo."""
    press("patina.import_demo")
    press("view3d.view_center_camera")
    yield REDRAW_DELAY
    photograph("2_scan")
    bpy.context.scene.patina_photos.active = 4
    yield from open_panel("photos")
    photograph("3_photos")


def materials_and_masks() -> Iterator[float]:
    """Propose materials, paint a wrong stroke on the mesh, and correct it on a photo."""
    scene = bpy.context.scene
    mesh = scene.patina.mesh
    yield from open_panel("masks")
    press("patina.propose_materials", "INVOKE_DEFAULT")
    yield from until_done()
    photograph("4_proposed")
    slots, paints = (
        part("scene.paint.paint_kinds").slots_of_faces,
        part("scene.paint.paint_kinds").paints,
    )
    before = slots(mesh)
    press("patina.paint_mesh")
    press("patina.pick_paint", number=1)
    yield REDRAW_DELAY
    area = area_of("VIEW_3D")
    region = region_of(area)
    corners = [mesh.matrix_world @ v.co for v in list(mesh.data.vertices)[::997]]
    places = [
        location_3d_to_region_2d(region, area.spaces.active.region_3d, corner) for corner in corners
    ]
    middle = np.median([p for p in places if p is not None], axis=0)
    way = [on_screen(region, middle[0] + 6 * k - 60, middle[1] + 4 * k - 40) for k in range(21)]
    yield drag(way)
    photograph("5_painted_mesh")
    press("patina.take_paint")
    found["faces painted on the mesh"] = int((slots(mesh) != before).sum())
    before = slots(mesh)
    press("object.mode_set", mode="OBJECT")
    press("patina.pick_paint", number=0)
    press("patina.paint_photo")
    yield REDRAW_DELAY
    editor = area_of("IMAGE_EDITOR")
    with bpy.context.temp_override(window=window(), area=editor, region=region_of(editor)):
        bpy.ops.image.view_all(fit_view=True)
    yield REDRAW_DELAY
    view = region_of(editor)

    def across(left: float, right: float, height: float) -> list[tuple[int, int]]:
        ends = np.linspace(left, right, 24)
        return [on_screen(view, *view.view2d.view_to_region(x, height, clip=False)) for x in ends]

    yield drag(across(0.4, 0.6, 0.46))
    press("patina.pick_paint", number=[p.kind for p in paints(scene)].index("ignore"))
    yield drag(across(0.3, 0.7, 0.2))
    photograph("6_painted_photo")
    press("patina.take_paint")
    yield REDRAW_DELAY
    photograph("7_taken")
    found["faces painted on a photo"] = int((slots(mesh) != before).sum())
    masks = part("scene.paint.mask_images")
    capture = part("scene.session.scene_properties").capture_path(scene)
    found["painted photo"] = scene.patina_photos.active
    found["pixels ignored"] = {
        kind: int(masks.read_mask_image(image).sum())
        for (place, kind), image in masks.mask_images(capture).items()
        if place == scene.patina_photos.active
    }
    with bpy.context.temp_override(window=window(), area=editor, region=region_of(editor)):
        bpy.ops.screen.area_close()
    yield REDRAW_DELAY


def views() -> Iterator[float]:
    """Show views of the fit in an Image Editor."""
    yield from open_panel("check")
    press("patina.show_chart", kind="highlight")
    yield REDRAW_DELAY
    photograph("10_highlight")
    press("patina.look_at_photo", "INVOKE_DEFAULT", kind="comparison")
    yield from until_done()
    yield REDRAW_DELAY
    photograph("11_prediction")
    editor = area_of("IMAGE_EDITOR")
    with bpy.context.temp_override(window=window(), area=editor, region=region_of(editor)):
        bpy.ops.screen.area_close()
    yield REDRAW_DELAY


def fit_and_check() -> Iterator[float]:
    """Fit, diagnose, and mark the materials as assets."""
    yield from open_panel("fit")
    area_of("VIEW_3D").spaces.active.shading.type = "MATERIAL"
    press("patina.fit", "INVOKE_DEFAULT")
    yield 6.0
    photograph("8_fitting")
    yield from until_done()
    yield 10.0  # shaders
    photograph("9_fitted")
    view = area_of("VIEW_3D").spaces.active.region_3d
    before = view.view_perspective
    press("patina.show_proposed_photo")
    yield REDRAW_DELAY
    photograph("9_proposed_photo")
    assert "Proposed Lamp" in bpy.data.objects
    view.view_perspective = before
    yield from views()
    press("patina.check", "INVOKE_DEFAULT")
    yield from until_done()
    yield 10.0
    photograph("12_checked")
    assert bpy.ops.patina.explain_scan_quality(figure="Poses") == {"FINISHED"}
    yield from open_panel("material")
    press("patina.mark_assets")
    yield REDRAW_DELAY
    photograph("13_material")
    stored = part("scene.session.scene_properties")
    result = stored.stored_result(stored.capture_path(bpy.context.scene))
    found["materials"] = {m["name"]: m["samples"]["used"] for m in result["materials"]}
    scene = bpy.context.scene
    found["photos"] = len(scene.patina_photos.photos)
    found["lamps"] = sum(o.type == "LIGHT" for o in scene.objects)
    slots = part("scene.paint.paint_kinds").slots_of_faces(scene.patina.mesh)
    found["faces"] = np.bincount(slots).tolist()


def judge() -> None:
    """Check the results of the session and save the file."""
    assert found["faces painted on the mesh"] > 20, found
    assert found["faces painted on a photo"] > 20, found
    assert found["pixels ignored"]["ignore"] > 100, found
    assert len(found["materials"]) == 2, found
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "session.blend"))


def session() -> Iterator[float]:
    """Run all stages; yields the seconds to wait after each step."""
    for stage in (begin, scan_and_photos, materials_and_masks, fit_and_check):
        print("session:", stage.__name__, flush=True)
        yield from stage()
    judge()


def end(code: int) -> None:
    """Write and print the results, and quit Blender."""
    (OUT / "session.json").write_text(json.dumps(found, indent=1), "utf-8")
    print("session:", "failed" if code else "done", found, flush=True)
    os._exit(code)


STEPS = session()


def tick() -> float | None:
    """Run the next step; any exception ends the session."""
    try:
        wait = next(STEPS)
    except StopIteration:
        end(0)
    except BaseException:
        traceback.print_exc()
        photograph("failed")
        end(1)
    if wait >= REDRAW_DELAY:
        area_of("VIEW_3D").tag_redraw()
    return wait


def too_long() -> None:
    """End the session after the timeout."""
    print(f"session: not finished after {TIMEOUT} s", flush=True)
    end(1)


def noting(panel: type[bpy.types.Panel]) -> None:
    """Record that a panel is open: Blender only draws the contents of open panels."""
    draw, stage = panel.draw, panel.stage

    def noted(self: bpy.types.Panel, context: bpy.types.Context) -> None:
        drawn.add(stage)
        draw(self, context)

    panel.draw = noted


def close_panels() -> None:
    """Close all panels before the first redraw, so that the positions of headers are known."""
    panels = [c for c in bpy.types.Panel.__subclasses__() if c.__name__.startswith("PATINA_PT_")]
    panels += [c for c in part("panels.sidebar").CLASSES if c.__name__.startswith("PATINA_PT_")]
    panels = list(dict.fromkeys(panels))
    inner = [panel for panel in panels if getattr(panel, "bl_parent_id", "")]
    outer = [panel for panel in panels if getattr(panel, "stage", "")]  # preset menus have no stage
    for panel in (*inner, *outer):
        bpy.utils.unregister_class(panel)
    outer.sort(key=lambda panel: STAGES.index(panel.stage))
    for panel in outer:
        noting(panel)
    for panel in (*outer, *inner):
        panel.bl_options = set() if panel.bl_idname == "PATINA_PT_views" else {"DEFAULT_CLOSED"}
        bpy.utils.register_class(panel)


OUT.mkdir(parents=True, exist_ok=True)
try:
    close_panels()
except BaseException:  # otherwise Blender prints the error and stays open
    traceback.print_exc()
    end(1)
bpy.app.timers.register(tick, first_interval=3)
bpy.app.timers.register(too_long, first_interval=TIMEOUT)
