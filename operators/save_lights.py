"""Photos stage: what was dragged in the scene, into a capture file."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.capture import read_capture
from ..core.capture.write_lights import write_lights
from ..core.errors import InputError, PatinaError
from ..scene.photos.dragged_lamps import accept, with_dragged_lamps
from ..scene.session.scene_properties import capture_path
from .report_errors import refuse


class PATINA_OT_save_lights(bpy.types.Operator):
    """Save the capture file with the lights as their lamps stand now; all else in it is kept"""

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
        cls.poll_message_set("Import a capture first: it says which lights there are")
        return False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            path = Path(capture_path(context.scene))
            name = path.name.removesuffix(".toml").removesuffix(".capture")
            self.filepath = str(path.with_name(f"{name}_lights.capture.toml"))
        self._shown = True  # the file browser marks a name that is taken
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            names, out = self._save(context)
        except PatinaError as error:
            return refuse(self, error)
        said = ", ".join(names) if names else "no lamp was changed: a copy"
        self.report({"INFO"}, f"{out.name}: {said}")
        return {"FINISHED"}

    def _save(self, context: bpy.types.Context) -> tuple[list[str], Path]:
        path = Path(capture_path(context.scene))
        asked = Path(bpy.path.abspath(self.filepath))
        if not self.filepath or asked.is_dir():
            raise InputError("expected the name of a file", key="filepath")
        out = asked if asked.suffix == ".toml" else asked.with_name(f"{asked.name}.capture.toml")
        agreed = not self.check_existing or (getattr(self, "_shown", False) and out == asked)
        if out.exists() and not agreed:
            raise InputError("is there already; choose another name", file=out)
        capture = read_capture(path)
        now, names = with_dragged_lamps(capture, context.scene)
        write_lights(capture, now.lights, out)
        if out.resolve() == capture.file:
            accept(capture, context.scene)
        return names, out


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_save_lights,))
