"""The sidebar tab: Scan, Photos & Light, Materials & Masks, Fit, Check, Material & Export, in
workflow order."""

from __future__ import annotations

import bpy

from ..scene.material.fallback import osl_hindrance
from ..scene.material.measured_materials import measured_materials, measured_of
from ..scene.photos.photo_list import looked_at
from ..scene.property_keys import NO_OSL_REASON
from ..scene.session.running_job import running
from ..scene.session.scene_properties import DIAGNOSIS, capture_path, stored_result
from .check_box import draw_check
from .draft_box import draw_draft
from .lamp_box import draw_lamp
from .mask_box import draw_masks
from .measured_box import draw_measured, icon_of
from .orientation_row import draw_orientation
from .photo_rows import PATINA_UL_photos, draw_photos
from .stage import StagePanel
from .traits_box import status_label
from .variation_box import draw_variation
from .wrapped import wrapped


class PATINA_PT_scan(StagePanel, bpy.types.Panel):
    bl_idname = "PATINA_PT_scan"
    bl_label = "Scan"
    stage = "scan"

    def draw(self, context: bpy.types.Context) -> None:
        if context.scene.patina_draft.is_open and running(context.scene) is None:
            draw_draft(self.layout, context.scene)
        else:
            super().draw(context)

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        mesh = context.scene.patina.mesh
        if mesh is None or mesh.name not in context.scene.objects:
            layout.operator("patina.add_files", icon="FILE_NEW")
            layout.operator("patina.solve_photos", icon="CAMERA_DATA")
            layout.operator_menu_enum("patina.import_demo", "subject", icon="MONKEY")
        else:
            layout.operator("patina.import_capture", icon="IMPORT")
            layout.operator("patina.add_files", icon="FILE_NEW")
        draw_orientation(layout, context.scene)


class PATINA_PT_photos(StagePanel, bpy.types.Panel):
    bl_idname = "PATINA_PT_photos"
    bl_label = "Photos & Light"
    stage = "photos"

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        draw_photos(layout, context.scene, context.area)
        if looked_at(context.scene) is not None:
            draw_lamp(layout, context.scene, context.scene.camera)


class PATINA_PT_masks(StagePanel, bpy.types.Panel):
    bl_idname = "PATINA_PT_masks"
    bl_label = "Materials & Masks"
    bl_options = {"DEFAULT_CLOSED"}
    stage = "masks"

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        draw_masks(layout, context.scene)


class PATINA_PT_fit(StagePanel, bpy.types.Panel):
    bl_idname = "PATINA_PT_fit"
    bl_label = "Fit"
    stage = "fit"

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        capture = capture_path(context.scene)
        if capture:
            layout.prop(context.scene.patina, "varying")
        draw_measured(layout, stored_result(capture), measured_of(capture))
        draw_variation(layout, context.scene.patina.mesh)


class PATINA_PT_check(StagePanel, bpy.types.Panel):
    bl_idname = "PATINA_PT_check"
    bl_label = "Check"
    bl_options = {"DEFAULT_CLOSED"}
    stage = "check"

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        diagnosis = stored_result(capture_path(context.scene), DIAGNOSIS)
        if diagnosis is not None:
            draw_check(layout, diagnosis, context.scene.patina.causes)


class PATINA_PT_material(StagePanel, bpy.types.Panel):
    bl_idname = "PATINA_PT_material"
    bl_label = "Material & Export"
    stage = "material"

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        found = measured_materials()
        reasons = {m[NO_OSL_REASON] for m in found if NO_OSL_REASON in m}
        hindrance = osl_hindrance(context.scene) if found else None
        for material in found:
            row = layout.row()
            row.label(text=material.name, icon_value=icon_of(material))
            portable = NO_OSL_REASON in material or hindrance is not None
            row.label(text=status_label(material, portable))
        for reason in sorted({*reasons} if reasons else {hindrance} - {None}):
            wrapped(layout, f"Renders do not show the measured BRDF: {reason}", "INFO")
        if found:
            layout.operator("patina.mark_assets", icon="ASSET_MANAGER")


CLASSES = (
    PATINA_UL_photos,
    PATINA_PT_scan,
    PATINA_PT_photos,
    PATINA_PT_masks,
    PATINA_PT_fit,
    PATINA_PT_check,
    PATINA_PT_material,
)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
