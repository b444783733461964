"""Views panel, below Check: charts of a measured material and their display settings."""

from __future__ import annotations

import bpy

from ..operators.views import ITEMS, PHOTO_ITEMS
from ..scene.views.view_properties import FILE, MATERIAL, looked_at

ICONS = {
    "sphere": "MATERIAL", "polar": "LIGHT_SPOT", "highlight": "FCURVE", "slice": "IMAGE_DATA",
    "interval": "MOD_NOISE", "ratio": "MOD_MIRROR", "comparison": "IMAGE_REFERENCE",
    "samples": "EYEDROPPER",
}  # fmt: skip
ANGLES = {"polar": "incidence", "highlight": "theta_d", "slice": "phi_d", "interval": "phi_d",
          "ratio": "phi_d"}  # fmt: skip
WITH_EXPOSURE = ("sphere", "comparison")


class PATINA_PT_views(bpy.types.Panel):
    bl_idname = "PATINA_PT_views"
    bl_label = "Views"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Patina"
    bl_translation_context = "Patina"  # Blender has other meanings of some labels
    bl_parent_id = "PATINA_PT_check"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return looked_at(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout, views = self.layout, context.scene.patina_views
        if views.material is None:
            layout.label(text=looked_at(context).name, icon="MATERIAL")
        layout.prop(views, "material")
        layout.label(text="Compare With:")
        layout.prop(views, "against", text="")
        if views.against == MATERIAL:
            layout.prop(views, "other", text="")
        elif views.against == FILE:
            layout.prop(views, "file", text="")
        grid = layout.grid_flow(columns=2, even_columns=True, align=True, row_major=True)
        for kind, name, _ in ITEMS:
            depressed = views.shown == kind
            grid.operator(
                "patina.show_chart", text=name, icon=ICONS[kind], depress=depressed
            ).kind = kind
        layout.separator()
        column = layout.column(align=True)
        for kind, name, _ in PHOTO_ITEMS:
            depressed = views.shown == kind
            column.operator(
                "patina.look_at_photo", text=name, icon=ICONS[kind], depress=depressed
            ).kind = kind
        if views.shown in WITH_EXPOSURE:
            layout.prop(views, "exposure", slider=True)
        if views.shown not in ANGLES:
            return
        column = layout.column()
        column.row().prop(views, "scale", expand=True)
        column.row().prop(views, "channels", expand=True)
        row = column.row()
        row.prop(views, "cosine")
        row.prop(views, ANGLES[views.shown])


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_views,))
