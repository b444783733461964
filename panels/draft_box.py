"""The new capture: what was recognised, its photos and lamps, and what is missing."""

from __future__ import annotations

import bpy

from ..core.counted import counted
from ..core.new_capture import Draft, LampKind, photo_folders
from ..scene.scan.capture_draft import PatinaDraft, PatinaDraftPhoto, draft_of
from .wrapped import wrapped

ROWS = 5
MAX_FOLDERS = 3  # of photos that are offered to be solved
NAME_SHARE, CAMERA_SHARE = 0.38, 0.6  # of a row's width; of the rest
CREATE_SCALE = 1.4  # height of the button to press next, in button heights
VALUE_LABELS = {
    LampKind.DISTANT.value: "Direction",
    LampKind.FLASH.value: "Right, Down, Forward of Lens",
    LampKind.NEAR.value: "Position",
}


class PATINA_UL_draft_photos(bpy.types.UIList):
    """One row per photo: whether it is used, its name, its camera and its lamp."""

    bl_idname = "PATINA_UL_draft_photos"

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        data: PatinaDraft,
        item: PatinaDraftPhoto,
        icon: int,
        active: PatinaDraft,
        property_name: str,
    ) -> None:
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        names = row.split(factor=NAME_SHARE, align=True)
        names.active = item.use
        names.label(text=item.name)
        if item.use:
            right = names.split(factor=CAMERA_SHARE, align=True) if item.lamp else names
            icon = "NONE" if item.camera else "ERROR"
            right.label(text=item.camera or "none", icon=icon)
            if item.lamp:
                right.label(text=item.lamp)


def draw_draft(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the draft and its buttons."""
    state = scene.patina_draft
    draft = draft_of(scene)
    for problem in draft.problems:
        wrapped(layout, problem, "ERROR")
    for sentence in draft.found:
        wrapped(layout, sentence, "CHECKMARK")
    for name, path in (("Cameras", draft.cameras), ("Mesh", draft.mesh)):
        icon = "BLANK1" if path else "RADIOBUT_OFF"
        layout.label(text=f"{name}: {path.name if path else 'none yet'}", icon=icon)
    layout.operator("patina.add_files", text="Add or Replace Files…", icon="FILE_FOLDER")
    if draft.cameras is None:
        _draw_solve(layout, draft)
    if len(state.photos):
        _draw_photos(layout, state)
    lost = draft.without_camera
    if lost and draft.cameras is not None and draft.mesh is not None:
        text = f"Localise {counted(len(lost), 'Photo')}"
        layout.operator("patina.localise_draft", text=text, icon="CAMERA_DATA")
    if draft.missing is not None:
        wrapped(layout, draft.missing, "INFO")
    row = layout.row()
    row.scale_y = CREATE_SCALE
    row.operator("patina.create_capture", icon="CHECKMARK")
    layout.operator("patina.cancel_draft", icon="X")


def _draw_solve(layout: bpy.types.UILayout, draft: Draft) -> None:
    """A button for each folder that may hold the photos of the scan."""
    folders = photo_folders([photo.file for photo in draft.photos])[:MAX_FOLDERS]
    for folder, count in folders:
        text = f"Solve {counted(count, 'Photo')} in “{folder.name}”"
        button = layout.operator("patina.solve_draft", text=text, icon="CAMERA_DATA")
        button.folder = str(folder)
    if not folders:
        layout.operator("patina.solve_photos", icon="CAMERA_DATA")


def _draw_photos(layout: bpy.types.UILayout, state: PatinaDraft) -> None:
    layout.template_list(
        PATINA_UL_draft_photos.bl_idname, "", state, "photos", state, "active_photo", rows=ROWS
    )
    photo = state.photos[min(state.active_photo, len(state.photos) - 1)]
    column = layout.column(align=True)
    column.prop_search(photo, "camera", state, "labels", icon="CAMERA_DATA")
    if photo.how:
        how = f"matched {photo.how}" if photo.how.startswith("by ") else photo.how
        column.label(text=how[0].upper() + how[1:], icon="BLANK1")
    column.prop_search(photo, "lamp", state, "lamps", icon="LIGHT")
    row = layout.row(align=True)
    row.operator("patina.draft_lamps", text="One Lamp").way = "ONE"
    row.operator("patina.draft_lamps", text="One per Photo").way = "EACH"
    row.operator("patina.draft_lamps", text="", icon="ADD").way = "ADD"
    lamp = state.lamps.get(photo.lamp)
    if lamp is None:
        return
    column = layout.column(align=True)
    column.prop(lamp, "kind")
    if lamp.kind in (LampKind.FLASH.value, LampKind.NEAR.value):
        column.prop(lamp, "stated")
    if lamp.kind == LampKind.DISTANT.value or (lamp.stated and lamp.kind in VALUE_LABELS):
        column.prop(lamp, "values", text=VALUE_LABELS[lamp.kind])


register, unregister = bpy.utils.register_classes_factory((PATINA_UL_draft_photos,))
