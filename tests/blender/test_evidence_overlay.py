"""Show Where is a toggle: the shading before it comes back, whichever way it is left."""

from __future__ import annotations

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module

BEFORE = ("MATERIAL", "TEXTURE", "MATCAP")
SHOWN = ("SOLID", "VERTEX", "FLAT")


def scanned() -> bpy.types.Object:
    """A capture with evidence as a check leaves it, in a viewport with a shading of its own."""
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    mesh = bpy.context.scene.patina.mesh
    own = mesh.data.color_attributes.new("Col", "BYTE_COLOR", "POINT")
    for cause in ("residual", "camera_pose"):
        mesh.data.color_attributes.new(f"Patina: {cause}", "BYTE_COLOR", "POINT")
    mesh.data.color_attributes.active_color = own
    for view in views():
        shading = view.spaces.active.shading
        shading.type = "SOLID"
        shading.color_type, shading.light = BEFORE[1:]
        shading.type = BEFORE[0]
    return mesh


def views() -> list[bpy.types.Area]:
    areas = bpy.context.window_manager.windows[0].screen.areas
    return [area for area in areas if area.type == "VIEW_3D"]


def shading() -> tuple[str, str, str]:
    """Of the viewport; its settings for solid shading are read in that shading."""
    found = views()[0].spaces.active.shading
    kind = found.type
    found.type = "SOLID"
    answer = kind, found.color_type, found.light
    found.type = kind
    return answer


def show(cause: str) -> None:
    assert bpy.ops.patina.show_evidence(cause=cause) == {"FINISHED"}


def test_second_press_restores_shading_and_colour() -> None:
    mesh = scanned()
    show("residual")
    assert shading() == SHOWN
    assert mesh.data.color_attributes.active_color.name == "Patina: residual"
    show("camera_pose")  # another cause: still the overlay
    assert shading() == SHOWN
    assert mesh.data.color_attributes.active_color.name == "Patina: camera_pose"
    show("camera_pose")
    assert shading() == BEFORE
    assert mesh.data.color_attributes.active_color.name == "Col"


def test_another_photo_leaves_overlay() -> None:
    scanned()
    show("residual")
    bpy.context.scene.patina_photos.active = 1
    assert shading() == BEFORE


def test_proposal_and_fit_leave_overlay() -> None:
    scanned()
    show("residual")
    assert bpy.ops.patina.propose_materials() == {"FINISHED"}
    assert shading() == BEFORE
    bpy.context.scene.patina.use_slots = False
    show("residual")
    bpy.context.scene.patina_photos.mesh_over = 0.35
    assert bpy.ops.patina.fit() == {"FINISHED"}
    assert shading() == BEFORE
    assert bpy.context.scene.patina_photos.mesh_over == 1.0, "the photo covers the material"


def test_undo_and_new_file_leave_overlay() -> None:
    overlay = extension("scene.session.overlay_shading")
    check = extension("scene.views.evidence_overlay")._check
    mesh = scanned()
    show("residual")
    check()  # an undo that keeps the overlay's colours
    assert overlay.overlay_shown() == "residual"
    del mesh["patina_overlay"]
    check()  # the undo of Show Where itself: Blender undoes the mark, not the shading
    assert shading() == BEFORE and overlay.overlay_shown() == ""
    show("residual")
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=False)
    assert shading() == BEFORE and overlay.overlay_shown() == ""


def test_saved_overlay_can_be_left_after_load() -> None:
    scanned()
    show("residual")
    path = str(folder() / "shown.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert shading() == SHOWN
    show("residual")
    assert shading() == BEFORE


def test_own_shading_is_kept() -> None:
    """A shading that the user chose while the overlay was shown is not replaced."""
    scanned()
    show("residual")
    views()[0].spaces.active.shading.type = "WIREFRAME"
    assert extension("scene.session.overlay_shading").overlay_shown() == ""
    extension("scene.session.overlay_shading").leave_overlay()
    assert shading()[0] == "WIREFRAME"


def test_legend_states_scale_and_unit() -> None:
    overlay = extension("scene.views.evidence_overlay")
    colours_of = extension("scene.scan.vertex_colours").colours_of
    title, ends = overlay.legend("camera_pose")
    assert "Wrong Camera Poses" in title and ends == ("10 % darker", "none", "10 % brighter")
    assert np.allclose(overlay.scale_colours("camera_pose", 3), colours_of(np.array([-1, 0, 1])))
