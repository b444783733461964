"""Materials and masks in the sidebar: propose, paint and export them."""

from __future__ import annotations

import bpy

from ..scene.paint.mask_images import mask_images, shadow_images
from ..scene.paint.paint_kinds import Paint, paints
from ..scene.paint.swatches import swatch
from ..scene.photos.photo_list import looked_at
from ..scene.session.scene_properties import capture_path, stored_result
from .wrapped import IN_BOX, wrapped

MASK_LABELS = {
    "shadow": "Shadow",
    "highlight": "Excluded Highlight",
    "ignore": "Ignore",
    "erase": "Erase Masks",
}


def draw_masks(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the materials and masks that can be painted, and the buttons to paint them."""
    kinds, state, capture = paints(scene), scene.patina_paint, capture_path(scene)
    materials = [p for p in kinds if p.kind == "material"] if scene.patina.use_slots else []
    box = layout.box()
    head = box.row()
    head.label(text="Materials")
    buttons = head.row(align=True)
    buttons.operator("patina.add_material", text="", icon="ADD")
    if materials:
        buttons.operator("patina.remove_material", text="", icon="REMOVE")
    for number, paint in enumerate(materials):
        _row(box, scene, paint, number, number == state.active)
    if not materials:
        names = [m["name"] for m in (stored_result(capture) or {}).get("materials", [])]
        if len(names) > 1:
            wrapped(box, f"Materials of the capture: {', '.join(names)}", "BLANK1", IN_BOX)
        else:
            box.label(text="One material for the whole object", icon="BLANK1")
    row = box.row(align=True)
    row.operator("patina.propose_materials", text="Propose", icon="SHADERFX")
    row.operator("patina.slots_from_face_sets", text="Face Sets", icon="FACE_MAPS")
    box = layout.box()
    box.label(text="Excluded from Photos")
    first = sum(paint.kind == "material" for paint in kinds)
    for number, paint in enumerate(kinds[first:], start=first):
        _row(box, scene, paint, number, number == state.active)
    layout.separator()
    column = layout.column(align=True)
    column.operator("patina.paint_mesh", icon="VPAINT_HLT")
    column.operator("patina.paint_photo", icon="TPAINT_HLT")
    column.operator("patina.take_paint", icon="CHECKMARK")
    layout.prop(state, "opacity", slider=True)
    if shadow_images(capture_path(scene)):
        layout.operator("patina.shadow_masks", text="Recompute Shadow Masks").replace = True
    layout.operator("patina.export_masks", icon="EXPORT")
    mesh = scene.patina.mesh
    if mesh is not None and mesh.type == "MESH" and any(mesh.data.materials):
        layout.prop(scene.patina, "use_slots")


def _row(
    layout: bpy.types.UILayout, scene: bpy.types.Scene, paint: Paint, number: int, active: bool
) -> None:
    row = layout.row(align=True)
    slot = scene.patina.mesh.material_slots[paint.slot] if paint.slot >= 0 else None
    label = MASK_LABELS.get(paint.kind, paint.name)
    icon = "RADIOBUT_ON" if active else "RADIOBUT_OFF"
    row.operator("patina.pick_paint", text="", icon=icon, depress=active).number = number
    row.label(text="", icon_value=swatch(paint.colour))
    if slot is None:
        row.operator("patina.pick_paint", text=label, depress=active).number = number
    elif slot.material is not None and slot.material.name == paint.name:
        row.prop(slot.material, "name", text="")
    else:
        row.label(text=paint.name)
    photo = looked_at(scene)
    masks = mask_images(capture_path(scene)) if slot is None else {}
    if photo is not None and (photo.place, paint.kind) in masks:
        row.label(text="", icon="IMAGE_ALPHA")
