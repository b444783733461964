"""Material stage: mark the measured materials as assets."""

from __future__ import annotations

import bpy

from ..scene.material.assets import mark
from ..scene.material.measured_materials import measured_of
from ..scene.session.scene_properties import capture_path, stored_result


class PATINA_OT_mark_assets(bpy.types.Operator):
    """Mark the measured materials as assets, with preview, tags and provenance. Save the file in \
an asset library to use them in other files"""

    bl_idname = "patina.mark_assets"
    bl_label = "Mark as Assets"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if measured_of(capture_path(context.scene)):
            return True
        cls.poll_message_set("No measured materials yet; fit the materials first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        capture = capture_path(context.scene)
        result = stored_result(capture)
        if result is None:
            self.report({"ERROR"}, "The result of the fit is no longer in this file. Fit again.")
            return {"CANCELLED"}
        marked = [m.name for m in measured_of(capture).values() if mark(m, result)]
        if not marked:
            self.report(
                {"ERROR"}, "None of these materials is in the result of the last fit. Fit again."
            )
            return {"CANCELLED"}
        self.report({"INFO"}, f"Marked as assets: {', '.join(marked)}.")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_mark_assets,))
