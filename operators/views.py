"""Charts of a measured material, shown in an Image Editor."""

from __future__ import annotations

import bpy

from ..core.errors import PatinaError
from ..scene.image_editor import show_image
from ..scene.views import looked_at, show_chart
from .report_errors import refuse

ITEMS = (
    ("sphere", "Lit Sphere", "Under a key light and a rim light"),
    ("polar", "Polar Slice", "Reflectance in the plane of incidence, with what was measured there"),
    ("highlight", "Highlight", "Reflectance against the half vector's angle, with what was "
     "measured there"),
    ("slice", "Image Slice", "The BRDF over half and difference angle, and the samples"),
    ("interval", "Certainty", "How far off the BRDF may be, over half and difference angle"),
    ("ratio", "Ratio", "The BRDF that it is compared with, divided by this one"),
)  # fmt: skip


class PATINA_OT_show_chart(bpy.types.Operator):
    """Draw this of the measured material, with its samples and its 90 % interval, and show it in \
an Image Editor"""

    bl_idname = "patina.show_chart"
    bl_label = "Show Chart"
    bl_options = {"REGISTER", "UNDO"}

    kind: bpy.props.EnumProperty(name="Chart", items=ITEMS)  # type: ignore[valid-type]

    @classmethod
    def description(cls, context: bpy.types.Context, properties: object) -> str:
        return next(said for key, _, said in ITEMS if key == properties.kind)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if looked_at(context) is None:
            cls.poll_message_set("Fit first: there is no measured material in this file")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            image = show_chart(context, self.kind)
        except PatinaError as error:
            return refuse(self, error)
        show_image(context, image)
        return {"FINISHED"}


def register() -> None:
    bpy.utils.register_class(PATINA_OT_show_chart)


def unregister() -> None:
    bpy.utils.unregister_class(PATINA_OT_show_chart)
