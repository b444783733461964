"""Files dropped onto a 3D viewport: a capture is imported, a file of cameras starts a new capture,
and for photos the user is asked what they are. Meshes and photos are added to a new capture that is
being set up.

Blender selects the handler by file suffix; a folder has none and cannot be dropped.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..core.capture import read_capture
from ..core.capture.new_capture import CAMERAS, PHOTOS
from ..core.counted import counted
from ..core.errors import PatinaError
from ..core.scan.mesh import READERS
from ..scene.session.running_job import running
from ..scene.session.scene_properties import capture_path
from .report_errors import call_operator, report_and_cancel

NOTHING, SOLVE, LIT = "NOTHING", "SOLVE", "LIT"


class PATINA_OT_drop_photos(bpy.types.Operator):
    """Choose what to do with dropped photos: solve their cameras, or measure materials with them. \
The open capture is not changed"""

    bl_idname = "patina.drop_photos"
    bl_label = "Photos for Patina"
    bl_options = {"REGISTER", "UNDO"}

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})  # type: ignore[valid-type]
    files: bpy.props.CollectionProperty(  # type: ignore[valid-type]
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"}
    )
    use: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Use Photos As",
        description="What to do with the photos",
        items=[
            (NOTHING, "Nothing for Now", "Leave the scene as it is"),
            (SOLVE, "Photos to Solve", "Find the cameras of all photos in their folder"),
            (
                LIT,
                "Lit Photos",
                "Write a new capture with these photos, using the scan of the open capture or one "
                "that you choose",
            ),
        ],
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if running(context.scene) is None:
            return True
        cls.poll_message_set("Another job is running; press ESC to cancel it")
        return False

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the dialog."""
        layout = self.layout
        count = len(self.files)
        where = Path(self.directory).name
        layout.label(text=f"{counted(count, 'photo')} from {where}; nothing is imported yet")
        if context.scene.patina.capture:
            name = Path(capture_path(context.scene)).name
            layout.label(text=f"{name} is not changed; a capture file lists its own photos")
        layout.column().prop(self, "use", expand=True)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if context.scene.patina_draft.is_open:
            return self._add([])
        return context.window_manager.invoke_props_dialog(self, width=420)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if self.use == SOLVE:
            return call_operator(
                self, bpy.ops.patina.solve_photos, _execution_context(), directory=self.directory
            )
        if self.use == LIT:
            try:
                properties = self._scan(context.scene)
            except PatinaError as error:
                return report_and_cancel(self, error)
            if "chunk" not in properties:  # the rest of a new capture is added in the panel
                return self._add(list(properties.values()))
            properties["photos_directory"] = self.directory
            properties["photos"] = [{"name": one.name} for one in self.files]
            return call_operator(self, bpy.ops.patina.new_capture, "EXEC_DEFAULT", **properties)
        self.report({"INFO"}, "Nothing was imported.")
        return {"CANCELLED"}

    def _add(self, others: list[str]) -> set[str]:
        """Add the photos, and other files by their absolute paths, to the new capture."""
        names = [*others, *(one.name for one in self.files)]
        return call_operator(
            self, bpy.ops.patina.add_files, _execution_context(),
            directory=self.directory, files=[{"name": name} for name in names],
        )  # fmt: skip

    def _scan(self, scene: bpy.types.Scene) -> dict[str, Any]:
        """The scan of the open capture, as properties of patina.new_capture; {} without a
        capture."""
        path = capture_path(scene)
        if not path:
            return {}
        scan = read_capture(Path(path)).scan
        files = {"cameras": scan.cameras, "mesh": scan.mesh, "images": scan.images}
        properties = {key: str(value) for key, value in files.items() if value is not None}
        return {**properties, **({"chunk": scan.chunk} if scan.chunk else {})}


def _execution_context() -> str:
    """The execution context: a stepped job in a window, a single call without one."""
    return "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"


class ViewportDropHandler:
    """Mixin for file handlers that accept files dropped onto a 3D viewport."""

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Accept 3D viewports only."""
        return context.area is not None and context.area.type == "VIEW_3D"


class PATINA_FH_capture(ViewportDropHandler, bpy.types.FileHandler):
    """Import a dropped capture file."""

    bl_idname = "PATINA_FH_capture"
    bl_label = "Patina: Capture"
    bl_import_operator = "patina.import_capture"
    bl_file_extensions = ".toml"


class PATINA_FH_cameras(ViewportDropHandler, bpy.types.FileHandler):
    """Start a new capture from the file of a reconstruction tool."""

    bl_idname = "PATINA_FH_cameras"
    bl_label = "Patina: Cameras of a Scan"
    bl_import_operator = "patina.add_files"
    bl_file_extensions = ";".join(sorted(CAMERAS))


class PATINA_FH_photos(ViewportDropHandler, bpy.types.FileHandler):
    """Ask for the use of dropped photos, in any format that can be read."""

    bl_idname = "PATINA_FH_photos"
    bl_label = "Patina: Photos"
    bl_import_operator = "patina.drop_photos"
    bl_file_extensions = ";".join(sorted(PHOTOS))


class PATINA_FH_mesh(ViewportDropHandler, bpy.types.FileHandler):
    """Add a dropped mesh to the new capture; without one, Blender imports it."""

    bl_idname = "PATINA_FH_mesh"
    bl_label = "Patina: Mesh of the Scan"
    bl_import_operator = "patina.add_files"
    bl_file_extensions = ";".join(sorted(READERS))

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return super().poll_drop(context) and context.scene.patina_draft.is_open


CLASSES = (
    PATINA_OT_drop_photos,
    PATINA_FH_capture,
    PATINA_FH_cameras,
    PATINA_FH_photos,
    PATINA_FH_mesh,
)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
