"""Export panel, below Material & Export: the formats to write. The header's menu holds presets of
formats."""

from __future__ import annotations

from typing import ClassVar

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..scene.export.export_choice import FORMATS, missing
from ..scene.views.outdated import changes_since
from .wrapped import wrapped

PRESETS = "patina/export"  # below the user's presets


class PATINA_OT_add_export_preset(AddPresetBase, bpy.types.Operator):
    """Add or remove a preset of export formats"""

    bl_idname = "patina.add_export_preset"
    bl_label = "Add Export Preset"
    preset_menu = "PATINA_PT_export_presets"
    preset_subdir = PRESETS
    # no preset_defines: Blender 4.3 does not find the names in them under Python 3.13
    preset_defines: ClassVar[list[str]] = []
    preset_values: ClassVar[list[str]] = ["bpy.context.scene.patina_export.formats"]


class PATINA_PT_export_presets(PresetPanel, bpy.types.Panel):
    bl_idname = "PATINA_PT_export_presets"
    bl_label = "Export Presets"
    preset_subdir = PRESETS
    preset_operator = "script.execute_preset"
    preset_add_operator = "patina.add_export_preset"


class PATINA_PT_export(bpy.types.Panel):
    """The formats and the Export button."""

    bl_idname = "PATINA_PT_export"
    bl_label = "Export"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Patina"
    bl_translation_context = "Patina"  # Blender has other meanings of some labels
    bl_parent_id = "PATINA_PT_material"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        PATINA_PT_export_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        layout, scene = self.layout, context.scene
        grid = layout.grid_flow(columns=2, even_columns=True, align=True)
        for word in FORMATS:
            row = grid.row(align=True)
            row.active = missing(scene, word) is None
            row.prop_enum(scene.patina_export, "formats", word)
        for reason in (missing(scene, word) for word in FORMATS):
            if reason is not None:
                wrapped(layout, reason, "INFO")
        changes = changes_since(scene)
        if changes:
            wrapped(layout, f"Measured before {', '.join(changes)}", "INFO")
        layout.operator("patina.export", icon="EXPORT")


CLASSES = (PATINA_OT_add_export_preset, PATINA_PT_export_presets, PATINA_PT_export)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
