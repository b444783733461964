"""Material & Export: the formats to choose from, below the measured materials."""

from __future__ import annotations

import bpy

from ..scene.export_choice import FORMATS, missing


class PATINA_PT_export(bpy.types.Panel):
    """Formats and the one button."""

    bl_idname = "PATINA_PT_export"
    bl_label = "Export"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Patina"
    bl_parent_id = "PATINA_PT_material"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, scene = self.layout, context.scene
        grid = layout.grid_flow(columns=2, even_columns=True, align=True)
        for word in FORMATS:
            row = grid.row(align=True)
            row.active = missing(scene, word) is None
            row.prop_enum(scene.patina_export, "formats", word)
        layout.operator("patina.export", icon="EXPORT")


def register() -> None:
    bpy.utils.register_class(PATINA_PT_export)


def unregister() -> None:
    bpy.utils.unregister_class(PATINA_PT_export)
