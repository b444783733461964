"""Photos stage: look through the camera of a lit photo."""

from __future__ import annotations

import bpy

from ..scene.photos.photo_list import has_camera, lit_photos, looked_at
from ..scene.session.overlay_shading import leave_overlay
from ..scene.views.lamp_shading import toggle_lamp_shading


class PATINA_OT_next_photo(bpy.types.Operator):
    """Look through the camera of the next lit photo, with the photo behind the mesh and its lamp \
switched on"""

    bl_idname = "patina.next_photo"
    bl_label = "Next Lit Photo"
    bl_options = {"REGISTER", "UNDO"}

    step: bpy.props.IntProperty(default=1, options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        which = "previous" if properties.step < 0 else "next"
        return (
            f"Look through the camera of the {which} lit photo, with the photo behind the mesh and "
            "its lamp switched on"
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if lit_photos(context.scene):
            return True
        cls.poll_message_set("No lit photos in this scene; import a capture first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        photos, current = lit_photos(scene), looked_at(scene)
        index = (photos.index(current) + self.step) % len(photos) if current in photos else 0
        state = scene.patina_photos
        state.active = list(state.photos).index(photos[index])  # its update callback looks at it
        return {"FINISHED"}


class PATINA_OT_look_through_photo(bpy.types.Operator):
    """Look through the camera of this photo, with the photo behind the mesh and its lamp switched \
on"""

    bl_idname = "patina.look_through_photo"
    bl_label = "Look Through Photo"
    bl_options = {"REGISTER", "UNDO"}

    index: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Photo", description="Number of the photo in the list", options={"HIDDEN", "SKIP_SAVE"}
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        state = context.scene.patina_photos
        if not 0 <= self.index < len(state.photos):
            self.report({"ERROR"}, f"The list has no photo {self.index}; import the capture again")
            return {"CANCELLED"}
        if not has_camera(context.scene, state.photos[self.index]):
            self.report(
                {"ERROR"}, "The camera of this photo is not in the scene; import the capture again"
            )
            return {"CANCELLED"}
        state.active = self.index  # its update callback looks at it, also if it was active before
        return {"FINISHED"}


class PATINA_OT_lamp_shading(bpy.types.Operator):
    """Shade the mesh with the lamp of this photo, to compare shading and shadows with the photo \
while the lamp is moved. Other visible lamps of the scene shine too"""

    bl_idname = "patina.lamp_shading"
    bl_label = "Shade with Lamp"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"

    def execute(self, context: bpy.types.Context) -> set[str]:
        leave_overlay()
        toggle_lamp_shading(context.screen, context.area)
        return {"FINISHED"}


CLASSES = (PATINA_OT_next_photo, PATINA_OT_look_through_photo, PATINA_OT_lamp_shading)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
