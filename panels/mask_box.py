"""Shadow masks and proposed materials in the sidebar."""

from __future__ import annotations

import bpy

from ..scene.photo_list import looked_at
from ..scene.properties import capture_path
from ..scene.shadow_images import shadow_images


def draw_shadow(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Where there are shadow masks, say which image to paint on."""
    there = shadow_images(capture_path(scene))
    if not there:
        return
    photo = looked_at(scene)
    image = there.get(photo.place) if photo is not None else None
    if image is not None:
        layout.label(text=f"Paint: {image.name}", icon="IMAGE_ALPHA")
    layout.operator("patina.shadow_masks", text="Shadow Masks Anew").replace = True


def draw_materials(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Propose materials, and accept the mesh's slots."""
    layout.operator("patina.propose_materials", icon="MATERIAL")
    mesh = scene.patina.mesh
    if mesh is not None and mesh.type == "MESH" and any(mesh.data.materials):
        layout.prop(scene.patina, "use_slots")
