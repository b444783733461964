"""Material stage: the sliders of a measured material back to 0."""

from __future__ import annotations

import bpy

from ..scene.material.trait_offsets import measured_brdf, state
from ..scene.material.trait_properties import reset, shown_material


class PATINA_OT_reset_traits(bpy.types.Operator):
    """Put every slider to 0, and the material back to what was measured"""

    bl_idname = "patina.reset_traits"
    bl_label = "Reset to Measured"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = shown_material(context)
        if material is None:
            cls.poll_message_set("Nothing is measured yet: fit the materials first")
        elif not state(material):
            cls.poll_message_set(f"{material.name} is as measured")
        elif measured_brdf(material) is None:
            cls.poll_message_set("The components it was measured in are not on this computer")
        else:
            return True
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = shown_material(context)
        reset(material)
        self.report({"INFO"}, f"{material.name} is as measured again")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_reset_traits,))
