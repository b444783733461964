"""Material stage: reset the sliders of a measured material."""

from __future__ import annotations

import bpy

from ..scene.material.trait_offsets import measured_brdf, state
from ..scene.material.trait_properties import reset, shown_material


class PATINA_OT_reset_traits(bpy.types.Operator):
    """Set every slider to 0, which restores the material as measured"""

    bl_idname = "patina.reset_traits"
    bl_label = "Reset to Measured"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = shown_material(context)
        if material is None:
            cls.poll_message_set("No measured materials yet; fit the materials first")
        elif not state(material):
            cls.poll_message_set(f"{material.name} has no changed traits")
        elif measured_brdf(material) is None:
            cls.poll_message_set("The basis of this material is not on this computer")
        else:
            return True
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = shown_material(context)
        reset(material)
        self.report({"INFO"}, f"{material.name} was reset to the measurement.")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_reset_traits,))
