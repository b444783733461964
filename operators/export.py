"""Material stage: export the measured materials for other programs. A stepped job; ESC cancels."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.errors import InputError
from ..scene.export.export_choice import FORMATS
from ..scene.export.export_job import ExportJob
from ..scene.session.folders import cache_folder, export_folder, within_extension
from ..scene.session.running_job import set_running
from ..scene.session.scene_properties import capture_path, stored_result
from .report_errors import call_operator
from .stepped import Stepped


class PATINA_OT_export(Stepped, bpy.types.Operator):
    """Export the measured materials for other programs, and report what each format cannot store. \
The materials are those of the last fit; glTF and USD include the scanned mesh as it is now"""

    bl_idname = "patina.export"
    bl_label = "Export Materials"
    PANEL = "material"
    bl_options = {"REGISTER", "UNDO"}

    IN_CHILD = False
    TICK = 0.1
    CANCELLED = "Export cancelled."

    directory: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Directory",
        description="Folder in which the export folder is created",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})  # type: ignore[valid-type]
    folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Folder",
        description="Name of the export folder; an earlier export in it is replaced. If empty, the "
        "name of the capture followed by 'export'",
        options={"SKIP_SAVE"},
    )
    formats: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Formats",
        description="File formats to write the materials in",
        items=[(word, name, holds) for word, (name, holds) in FORMATS.items()],
        options={"ENUM_FLAG", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if stored_result(capture_path(context.scene)) is None:
            cls.poll_message_set("No measured materials yet; fit the materials first")
            return False
        return cls.idle(context)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the options in the side panel of the file browser."""
        layout = self.layout
        layout.prop(self, "folder")
        layout.label(text="Formats:")
        layout.column(align=True).prop(self, "formats")

    def execute(self, context: bpy.types.Context) -> set[str]:
        if getattr(self, "_picked", False):  # confirmed in the file browser: continue in steps
            chosen = {name: getattr(self, name) for name in ("directory", "folder", "formats")}
            return call_operator(self, bpy.ops.patina.export, "INVOKE_DEFAULT", **chosen)
        return super().execute(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.formats:
            self.formats = context.scene.patina_export.formats
        if not self.directory:
            self._picked = True
            self.directory = str(export_folder(capture_path(context.scene)))
            self.folder = self.folder or _default_name(context.scene)
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return super().invoke(context, event)

    def _start(self, context: bpy.types.Context) -> None:
        if not self.directory:
            raise InputError("no folder given; choose the folder to write into", key="directory")
        formats = self.formats or context.scene.patina_export.formats
        parent = Path(bpy.path.abspath(self.directory))
        if within_extension(parent):
            raise InputError(
                "is inside the folder of the extension, which an update deletes; choose another "
                "folder",
                file=parent,
                key="directory",
            )
        out = parent / (self.folder or _default_name(context.scene))
        self._job = ExportJob(context.scene, sorted(formats), out, cache_folder())
        self._scene = context.scene.name  # by name: a reference does not survive undo

    def _finish(self, context: bpy.types.Context) -> None:
        for loss in self._job.losses:
            head, *more = (line.strip() for line in loss.lines())
            kind = "WARNING" if loss.dropped else "INFO"
            text = f"{head}: {'; '.join(more)}" if more else head
            self.report({kind}, f"{text}.")
        count = len(self._job.files)
        self.report({"INFO"}, f"Files written: {count}, in {self._job.out}")


def _default_name(scene: bpy.types.Scene) -> str:
    """The default name of the export folder."""
    return f"{Path(capture_path(scene)).name.split('.')[0]} export"


register, _unregister_classes = bpy.utils.register_classes_factory((PATINA_OT_export,))


def unregister() -> None:
    """Remove the classes and the status line."""
    set_running(None)
    _unregister_classes()
