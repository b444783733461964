"""The list of lit photos."""

from __future__ import annotations

import bpy

from ..scene.paint.mask_images import shadow_images
from ..scene.photos.photo_list import (
    PatinaPhoto,
    PatinaPhotos,
    has_camera,
    looked_at,
)
from ..scene.session.scene_properties import capture_path
from ..scene.views.lamp_shading import lamp_shading

ROWS = 5
MESH_OVER = "scene.patina_photos.mesh_over"


class PATINA_UL_photos(bpy.types.UIList):
    """One row per photo: thumbnail, file name, light, and whether a shadow mask exists."""

    bl_idname = "PATINA_UL_photos"

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        data: PatinaPhotos,
        item: PatinaPhoto,
        icon: int,
        active: PatinaPhotos,
        property_name: str,
        index: int,
    ) -> None:
        available = has_camera(context.scene, item)
        row = layout.row(align=True)
        row.active = available
        preview = item.image.preview if item.image is not None else None
        shown = preview is not None and preview.icon_id
        icons = {"icon_value": preview.icon_id} if shown else {"icon": "IMAGE_DATA"}
        # a list calls nothing when its active row is clicked again; a button does
        name = row.row(align=True)
        name.alignment = "LEFT"
        name.operator(
            "patina.look_through_photo", text=item.name, emboss=False, **icons
        ).index = index
        right = row.row(align=True)
        right.alignment = "RIGHT"
        right.label(text=item.light)
        masked = item.place in shadow_images(capture_path(context.scene))
        state = "IMAGE_ALPHA" if masked else "BLANK1"
        right.label(text="", icon=state if available else "ERROR")


def draw_photos(
    layout: bpy.types.UILayout, scene: bpy.types.Scene, area: bpy.types.Area | None
) -> None:
    """Draw the list of photos, and the display settings of the active one."""
    state = scene.patina_photos
    if not len(state.photos):
        return
    layout.template_list(
        PATINA_UL_photos.bl_idname, "", state, "photos", state, "active", rows=ROWS, maxrows=ROWS
    )
    row = layout.row(align=True)
    row.operator("patina.next_photo", text="Previous", icon="TRIA_LEFT").step = -1
    row.operator("patina.next_photo", text="Next", icon="TRIA_RIGHT").step = 1
    photo = looked_at(scene)
    if photo is None:
        return
    column = layout.column(align=True)
    row = column.row(align=True)
    for text, icon, value in (("Photo", "IMAGE_DATA", 0.0), ("Mesh", "MESH_DATA", 1.0)):
        button = row.operator(
            "wm.context_set_float", text=text, icon=icon, depress=state.mesh_over == value
        )
        button.data_path, button.value = MESH_OVER, value
    column.prop(state, "mesh_over", slider=True)
    column.prop(state, "view_exposure", slider=True)
    shaded = area is not None and area.type == "VIEW_3D" and lamp_shading(area)
    column.operator("patina.lamp_shading", icon="SHADING_RENDERED", depress=shaded)
    if photo.exposure:
        column.label(text=f"Exposure: {photo.exposure:.4g}")
