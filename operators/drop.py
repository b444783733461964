"""Files dropped onto a 3D viewport: captures come in, cameras become one, photos are asked about.

Blender hands over files by their suffix; a folder has none and cannot be dropped.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..core.capture import read_capture
from ..core.capture.new_capture import CAMERAS, PHOTOS
from ..core.errors import PatinaError
from ..scene.session.running_job import running
from ..scene.session.scene_properties import capture_path
from .report_errors import hand_on, refuse

NOTHING, SOLVE, LIT = "NOTHING", "SOLVE", "LIT"


class PATINA_OT_drop_photos(bpy.types.Operator):
    """Ask what dropped photos are: those of a scan to be solved, or lit ones to measure with. \
Nothing is added to a capture that is open"""

    bl_idname = "patina.drop_photos"
    bl_label = "Photos for Patina"
    bl_options = {"REGISTER", "UNDO"}

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})  # type: ignore[valid-type]
    files: bpy.props.CollectionProperty(  # type: ignore[valid-type]
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"}
    )
    use: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="They Are",
        description="What is to be done with them",
        items=[
            (NOTHING, "Nothing for Now", "Leave the scene as it is"),
            (SOLVE, "A Scan to Solve", "Find the cameras of all photos in their folder"),
            (
                LIT,
                "Lit Photos",
                "Write a new capture with them: of the open capture's scan, or of one to choose",
            ),
        ],
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if running(context.scene) is None:
            return True
        cls.poll_message_set("Something is running; ESC stops it")
        return False

    def draw(self, context: bpy.types.Context) -> None:
        """The question."""
        layout = self.layout
        count = len(self.files)
        where = Path(self.directory).name
        layout.label(text=f"{count} photo{'s' * (count != 1)} from {where}; nothing is added yet")
        if context.scene.patina.capture:
            name = Path(capture_path(context.scene)).name
            layout.label(text=f"{name} stays as it is: a capture file names its own photos")
        layout.column().prop(self, "use", expand=True)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self, width=420)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if self.use == SOLVE:
            return hand_on(self, bpy.ops.patina.solve_photos, _way(), directory=self.directory)
        if self.use == LIT:
            try:
                told = self._scan(context.scene)
            except PatinaError as error:
                return refuse(self, error)
            told["photos_directory"] = self.directory
            told["photos"] = [{"name": one.name} for one in self.files]
            way = "EXEC_DEFAULT" if "cameras" in told else "INVOKE_DEFAULT"
            return hand_on(self, bpy.ops.patina.new_capture, way, **told)
        self.report({"INFO"}, "Nothing was added")
        return {"CANCELLED"}

    def _scan(self, scene: bpy.types.Scene) -> dict[str, Any]:
        """The open capture's, as the properties of patina.new_capture; {} without one."""
        path = capture_path(scene)
        if not path:
            return {}
        said = read_capture(Path(path)).scan
        told = {"cameras": said.cameras, "mesh": said.mesh, "images": said.images}
        words = {key: str(value) for key, value in told.items() if value is not None}
        return {**words, **({"chunk": said.chunk} if said.chunk else {})}


def _way() -> str:
    """In steps where somebody sees them."""
    return "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"


class OverViewport:
    """What is dropped into a 3D viewport."""

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Nowhere else."""
        return context.area is not None and context.area.type == "VIEW_3D"


class PATINA_FH_capture(OverViewport, bpy.types.FileHandler):
    """A capture file."""

    bl_idname = "PATINA_FH_capture"
    bl_label = "Patina: Capture"
    bl_import_operator = "patina.import_capture"
    bl_file_extensions = ".toml"


class PATINA_FH_cameras(OverViewport, bpy.types.FileHandler):
    """What a reconstruction tool wrote."""

    bl_idname = "PATINA_FH_cameras"
    bl_label = "Patina: Cameras of a Scan"
    bl_import_operator = "patina.new_capture"
    bl_file_extensions = ";".join(sorted(CAMERAS))


class PATINA_FH_photos(OverViewport, bpy.types.FileHandler):
    """Photos of any kind that is read."""

    bl_idname = "PATINA_FH_photos"
    bl_label = "Patina: Photos"
    bl_import_operator = "patina.drop_photos"
    bl_file_extensions = ";".join(sorted(PHOTOS))


CLASSES = (PATINA_OT_drop_photos, PATINA_FH_capture, PATINA_FH_cameras, PATINA_FH_photos)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
