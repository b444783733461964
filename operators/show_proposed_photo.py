"""Fit stage: show the photo that the fit proposes to take next."""

from __future__ import annotations

import bpy

from ..scene.photos.proposed_photo import camera_of_proposed_photo, show_proposed_lamp
from ..scene.session.scene_properties import capture_path, stored_result


class PATINA_OT_show_proposed_photo(bpy.types.Operator):
    """Select the camera of the proposed photo, and show with an arrow where its lamp shines from"""

    bl_idname = "patina.show_proposed_photo"
    bl_label = "Show Proposed Photo"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        result = stored_result(capture_path(context.scene)) or {}
        if result.get("proposed_photo") is not None:
            return True
        cls.poll_message_set("No photo is proposed; fit the materials first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        capture, objects = capture_path(context.scene), context.view_layer.objects
        photo = (stored_result(capture) or {})["proposed_photo"]
        camera = camera_of_proposed_photo(context.scene, capture, photo)
        if camera is None or camera.name not in objects:
            self.report(
                {"ERROR"},
                f"The camera {photo['camera']} of the scan is not in this view layer; include its "
                "collection, or import the capture again",
            )
            return {"CANCELLED"}
        shown = {
            camera,
            show_proposed_lamp(context.scene, capture, photo),
            context.scene.patina.mesh,
        }
        for thing in objects:
            thing.select_set(thing in shown)
        objects.active = camera
        if context.area is not None and context.area.type == "VIEW_3D":
            context.space_data.region_3d.view_perspective = "PERSP"
            bpy.ops.view3d.view_selected()
        self.report({"INFO"}, photo["sentence"])
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_show_proposed_photo,))
