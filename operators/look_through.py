"""Photos stage: stand where a lit photo was taken."""

from __future__ import annotations

import bpy

from ..scene import cameras


def lit_cameras(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras of lit photos, by name."""
    return sorted(
        (o for o in scene.objects if o.type == "CAMERA" and "patina_lit" in o),
        key=lambda o: o.name,
    )


class PATINA_OT_next_photo(bpy.types.Operator):
    """Look through the camera of the next lit photo, with the photo behind the mesh"""

    bl_idname = "patina.next_photo"
    bl_label = "Next Lit Photo"
    bl_options = {"REGISTER", "UNDO"}

    step: bpy.props.IntProperty(default=1, options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any("patina_lit" in o for o in context.scene.objects):
            return True
        cls.poll_message_set("No lit photos here yet: import a capture first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        found = lit_cameras(context.scene)
        now = context.scene.camera
        place = (found.index(now) + self.step) % len(found) if now in found else 0
        cameras.look_through(context.scene, found[place])
        for area in context.screen.areas if context.screen else ():
            if area.type == "VIEW_3D":
                area.spaces.active.region_3d.view_perspective = "CAMERA"
        return {"FINISHED"}


def register() -> None:
    bpy.utils.register_class(PATINA_OT_next_photo)


def unregister() -> None:
    bpy.utils.unregister_class(PATINA_OT_next_photo)
