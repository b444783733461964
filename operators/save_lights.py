"""Photos stage: save the lights as edited in the scene to a capture file."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.capture import read_capture
from ..core.capture.write_lights import write_lights
from ..core.errors import InputError, PatinaError
from ..scene.photos.dragged_lamps import accept, with_dragged_lamps
from ..scene.session.scene_properties import capture_path
from .report_errors import report_and_cancel


class PATINA_OT_save_lights(bpy.types.Operator):
    """Save the capture file with the lights as their lamps are now; the rest of it is kept"""

    bl_idname = "patina.save_lights"
    bl_label = "Save Lights"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})  # type: ignore[valid-type]
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})  # type: ignore[valid-type]
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.scene.patina.capture:
            return True
        cls.poll_message_set("Import a capture first; it defines the lights")
        return False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            path = Path(capture_path(context.scene))
            name = path.name.removesuffix(".toml").removesuffix(".capture")
            self.filepath = str(path.with_name(f"{name}_lights.capture.toml"))
        self._shown = True  # the file browser warns before it overwrites a file
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            names, out = self._save(context)
        except PatinaError as error:
            return report_and_cancel(self, error)
        saved = ", ".join(names) if names else "none (no lamp was changed)"
        self.report({"INFO"}, f"{out.name} saved. Updated lights: {saved}.")
        return {"FINISHED"}

    def _save(self, context: bpy.types.Context) -> tuple[list[str], Path]:
        path = Path(capture_path(context.scene))
        given = Path(bpy.path.abspath(self.filepath))
        if not self.filepath or given.is_dir():
            raise InputError("found no file name; choose the file to write", key="filepath")
        out = given if given.suffix == ".toml" else given.with_name(f"{given.name}.capture.toml")
        may_overwrite = not self.check_existing or (getattr(self, "_shown", False) and out == given)
        if out.exists() and not may_overwrite:
            raise InputError("the file exists already; choose another name", file=out)
        capture = read_capture(path)
        now, names = with_dragged_lamps(capture, context.scene)
        write_lights(capture, now.lights, out)
        if out.resolve() == capture.file:
            accept(capture, context.scene)
        return names, out


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_save_lights,))
