"""The sidebar tab: Scan, Photos, Fit, Check, Material, in the order of the work."""

from __future__ import annotations

import bpy

from ..core.report.figures import either_side
from ..operators.look_through import lit_cameras
from ..scene.apply import measured_materials
from ..scene.fallback import osl_hindrance
from ..scene.materials import REASON_PROPERTY
from ..scene.properties import DIAGNOSIS, capture_path, stored_result
from ..scene.running import running
from .check_box import draw_check
from .lamp_box import draw_lamp
from .mask_box import draw_materials, draw_shadow
from .wrapped import wrapped


class _Stage:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Patina"


class PATINA_PT_scan(_Stage, bpy.types.Panel):
    bl_idname = "PATINA_PT_scan"
    bl_label = "Scan"

    def draw(self, context: bpy.types.Context) -> None:
        layout, mesh = self.layout, context.scene.patina.mesh
        there = mesh is not None and mesh.name in context.scene.objects
        if there:
            layout.label(text=mesh.name, icon="MESH_DATA")
        layout.operator("patina.import_capture", icon="IMPORT")
        layout.operator("patina.solve_photos", icon="CAMERA_DATA")
        if not there:
            layout.operator("patina.import_demo", icon="MONKEY")


class PATINA_PT_photos(_Stage, bpy.types.Panel):
    bl_idname = "PATINA_PT_photos"
    bl_label = "Photos & Light"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        found = lit_cameras(context.scene)
        if not found:
            layout.label(text="No lit photos yet", icon="INFO")
            return
        camera = context.scene.camera
        if camera in found:
            place = f"{found.index(camera) + 1} of {len(found)}: {camera['patina_lit']}"
            layout.label(text=place, icon="CAMERA_DATA")
            draw_lamp(layout, context.scene, camera)
        else:
            layout.label(text=f"{len(found)} lit photos", icon="CAMERA_DATA")
        row = layout.row(align=True)
        row.operator("patina.next_photo", text="Previous", icon="TRIA_LEFT").step = -1
        row.operator("patina.next_photo", text="Next", icon="TRIA_RIGHT").step = 1
        draw_shadow(layout, context.scene)


class PATINA_PT_fit(_Stage, bpy.types.Panel):
    bl_idname = "PATINA_PT_fit"
    bl_label = "Fit"

    def draw(self, context: bpy.types.Context) -> None:
        layout, now = self.layout, running(context.scene)
        if now is not None:
            layout.progress(text=now.stage, factor=now.fraction, type="BAR")
            layout.label(text="ESC cancels", icon="CANCEL")
            return
        draw_materials(layout, context.scene)
        layout.operator("patina.fit", icon="SHADERFX")
        result = stored_result(capture_path(context.scene))
        for material in (result or {}).get("materials", []):
            box = layout.box()
            box.label(text=material["name"], icon="MATERIAL")
            held = material.get("held_out")
            if held:
                box.label(text=f"Predicts unseen photos to {100 * held['typical']:.0f} %")
            if "interval_90" in material["uncertainty"]:
                known = either_side(material["uncertainty"]["median"])
                box.label(text=f"BRDF: {known} in half of directions")
            box.label(text=f"{material['samples']['used']:,} samples")
            for warning in material["warnings"]:
                wrapped(box, warning, "ERROR")


class PATINA_PT_check(_Stage, bpy.types.Panel):
    bl_idname = "PATINA_PT_check"
    bl_label = "Check"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        if running(context.scene) is not None:
            layout.label(text="Something is running", icon="SORTTIME")
            return
        layout.operator("patina.check", icon="VIEWZOOM")
        diagnosis = stored_result(capture_path(context.scene), DIAGNOSIS)
        if diagnosis is not None:
            draw_check(layout, diagnosis, context.scene.patina.causes)


class PATINA_PT_material(_Stage, bpy.types.Panel):
    bl_idname = "PATINA_PT_material"
    bl_label = "Material"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        found = measured_materials()
        if not found:
            layout.label(text="Nothing measured yet", icon="INFO")
        reasons = {m[REASON_PROPERTY] for m in found if REASON_PROPERTY in m}
        hindrance = osl_hindrance(context.scene) if found else None
        for material in found:
            row = layout.row()
            row.label(text=material.name, icon="MATERIAL")
            portable = REASON_PROPERTY in material or hindrance is not None
            row.label(text="Portable" if portable else "Measured")
        for reason in sorted({*reasons} if reasons else {hindrance} - {None}):
            wrapped(layout, f"Not the measurement itself: {reason}", "INFO")


CLASSES = (PATINA_PT_scan, PATINA_PT_photos, PATINA_PT_fit, PATINA_PT_check, PATINA_PT_material)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
