"""Scan stage: import a capture into the scene."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.capture import read_capture
from ..core.errors import PatinaError
from ..core.inputs import capture_data
from ..core.inputs.lights import find_lights
from ..core.inputs.photos import LitPhotos
from ..scene.scan.objects_in_the_way import hide_in_the_way
from ..scene.scan.orientation import set_upright
from ..scene.scan.scan_collection import create_scan_collection, find_earlier_import
from ..scene.session.camera_view import show_camera_view
from ..scene.session.folders import rectified_folder
from .report_errors import report_and_cancel

ASSETS = Path(__file__).parents[1] / "assets"
DEMO, WORN = ASSETS / "demo" / "demo.capture.toml", ASSETS / "worn" / "worn.capture.toml"


class PATINA_OT_import_capture(bpy.types.Operator):
    """Import a capture: the scanned mesh, the cameras with their photos, and the lights"""

    bl_idname = "patina.import_capture"
    bl_label = "Import Capture"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})  # type: ignore[valid-type]
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})  # type: ignore[valid-type]

    def execute(self, context: bpy.types.Context) -> set[str]:
        return import_into_scene(self, context, Path(bpy.path.abspath(self.filepath)))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.filepath:
            return self.execute(context)
        self.filepath = ""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


class PATINA_OT_import_demo(bpy.types.Operator):
    """Import the example capture included with Patina, to try it without photos of your own"""

    bl_idname = "patina.import_demo"
    bl_label = "Import Demo Capture"
    bl_options = {"REGISTER", "UNDO"}

    subject: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Demo",
        items=(
            ("GLAZED", "Glazed Jar", "Two materials, and two mistakes that a check finds"),
            ("WORN", "Worn Jar", "One material that varies: paint, metal and dirt"),
        ),
        options={"SKIP_SAVE"},
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        return import_into_scene(self, context, WORN if self.subject == "WORN" else DEMO)


def import_into_scene(
    operator: bpy.types.Operator, context: bpy.types.Context, path: Path
) -> set[str]:
    """Import a capture: read all files first, then create the objects. An error is reported and
    creates nothing."""
    try:
        existing = find_earlier_import(context.scene, path)
        if existing is not None:
            raise PatinaError(
                f"This capture is already in the scene; to import it again, delete the collection "
                f"{existing.name!r} first"
            )
        capture = read_capture(path)
        scan = capture_data.open_scan(capture)
        capture_data.check_photos(capture, scan)
        photos = LitPhotos.open(capture)
        lights = find_lights(capture, scan, photos)
        made = create_scan_collection(context.scene, capture, scan, lights, rectified_folder(path))
    except PatinaError as error:
        return report_and_cancel(operator, error)
    set_upright(context.scene)
    context.scene.patina.capture = str(path)
    context.scene.patina.mesh = made.mesh
    context.view_layer.update()  # the world matrices of the new objects
    hidden = hide_in_the_way(context.scene, made.mesh, list(made.cameras.values()))
    if hidden:
        operator.report({"INFO"}, f"Hidden, because in the way of the scan: {', '.join(hidden)}.")
    for selected in context.selected_objects:
        selected.select_set(False)
    made.mesh.select_set(True)
    context.view_layer.objects.active = made.mesh
    for area in context.screen.areas if context.screen else ():
        if area.type == "VIEW_3D":
            show_camera_view(area, context.scene)
    for note in (
        *scan.notes,
        *photos.notes,
        *lights.notes,
        *capture_data.size_notes(capture, scan),
    ):
        operator.report({"INFO"}, note)
    operator.report(
        {"INFO"},
        f"Imported: cameras {len(made.cameras)}, lit photos {len(capture.photos)}, "
        f"faces {len(scan.mesh.faces):,}.",
    )
    return {"FINISHED"}


def import_written(
    operator: bpy.types.Operator, context: bpy.types.Context, path: Path
) -> set[str]:
    """Import a capture file that was just written; delete the file if that fails."""
    done = import_into_scene(operator, context, path)
    if done == {"CANCELLED"}:
        path.unlink(missing_ok=True)  # import_into_scene has reported the error
    else:
        operator.report({"INFO"}, f"Capture file written: {path}")
    return done


CLASSES = (PATINA_OT_import_capture, PATINA_OT_import_demo)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
