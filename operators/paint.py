"""Paint materials and masks on the mesh or on a photo, with Blender's own brushes."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ..core.errors import PatinaError
from ..core.output_folder import check_out
from ..scene.paint.apply_paint import apply_strokes
from ..scene.paint.brushes import prepare_brush
from ..scene.paint.canvas import canvas_of, canvases, draw
from ..scene.paint.mask_files import write_masks
from ..scene.paint.mesh_paint import show_on_mesh, shown_on_mesh, slots_of_face_sets
from ..scene.paint.paint_kinds import assign_slots, paints, slots_of_faces, update_brushes
from ..scene.photos.photo_list import looked_at
from ..scene.scan.face_slots import leave_edit_mode, new_slot
from ..scene.session.image_editor import show_canvas
from ..scene.session.overlay_shading import leave_overlay
from ..scene.session.scene_properties import capture_path
from .report_errors import report_and_cancel


class _ScanOperator:
    """Mixin for operators on the scanned mesh of the scene's capture."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        mesh = context.scene.patina.mesh
        if not context.scene.patina.capture:
            cls.poll_message_set("Import a capture first")
            return False
        if mesh is None or mesh.type != "MESH" or mesh.name not in context.scene.objects:
            cls.poll_message_set("The scanned mesh is not in this scene")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            return self._do(context)
        except PatinaError as error:
            return report_and_cancel(self, error)

    def _do(self, context: bpy.types.Context) -> set[str]:
        raise NotImplementedError


class PATINA_OT_add_material(_ScanOperator, bpy.types.Operator):
    """Add a material slot to the scanned mesh, with its own paint colour"""

    bl_idname = "patina.add_material"
    bl_label = "Add Material"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Name", description="Name of the measured material", maxlen=60
    )

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        number = new_slot(scene, capture_path(scene), self.name)
        scene.patina.use_slots = True
        scene.patina_paint.active = number
        _redraw_paint(context)
        return {"FINISHED"}


class PATINA_OT_remove_material(_ScanOperator, bpy.types.Operator):
    """Remove the active material slot of the scanned mesh; its faces get the first material"""

    bl_idname = "patina.remove_material"
    bl_label = "Remove Material"
    bl_options = {"REGISTER", "UNDO"}

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        mesh, number = scene.patina.mesh, scene.patina_paint.active
        if not 0 <= number < len(mesh.material_slots):
            raise PatinaError("No material is active; choose one in the list, then remove it")
        slots = slots_of_faces(mesh)
        mesh.data.materials.pop(index=number)
        assign_slots(mesh, np.where(slots == number, 0, slots - (slots > number)))
        scene.patina_paint.active = max(number - 1, 0)
        scene.patina.use_slots = len(mesh.data.materials) > 0
        _redraw_paint(context)
        return {"FINISHED"}


class PATINA_OT_pick_paint(_ScanOperator, bpy.types.Operator):
    """Set Blender's brushes to the colour of this material or mask"""

    bl_idname = "patina.pick_paint"
    bl_label = "Pick Paint"
    bl_options = {"REGISTER", "UNDO"}

    number: bpy.props.IntProperty(options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]

    def _do(self, context: bpy.types.Context) -> set[str]:
        if not 0 <= self.number < len(paints(context.scene)):
            raise PatinaError(f"There is no material or mask with the number {self.number}")
        context.scene.patina_paint.active = self.number
        update_brushes(context)
        return {"FINISHED"}


class PATINA_OT_paint_mesh(_ScanOperator, bpy.types.Operator):
    """Paint materials on the mesh, for all photos at once. Press again to update the colours"""

    bl_idname = "patina.paint_mesh"
    bl_label = "Paint on the Mesh"
    bl_options = {"REGISTER", "UNDO"}

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene, mesh = context.scene, context.scene.patina.mesh
        if not scene.patina.use_slots or len(mesh.material_slots) < 2:
            raise PatinaError("There is only one material; add another one, then paint its area")
        leave_overlay()
        apply_strokes(scene)
        leave_edit_mode(mesh)
        context.view_layer.objects.active = mesh
        if mesh.mode != "VERTEX_PAINT":
            with context.temp_override(active_object=mesh, object=mesh):
                bpy.ops.object.mode_set(mode="VERTEX_PAINT")
        show_on_mesh(scene, mesh)
        prepare_brush(context, "vertex_paint")
        for area in context.screen.areas if context.screen else ():
            if area.type == "VIEW_3D":
                shading = area.spaces.active.shading
                shading.type, shading.color_type, shading.light = "SOLID", "VERTEX", "FLAT"
        return {"FINISHED"}


class PATINA_OT_paint_photo(_ScanOperator, bpy.types.Operator):
    """Paint materials and excluded areas on the active photo in an Image Editor"""

    bl_idname = "patina.paint_photo"
    bl_label = "Paint on This Photo"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if looked_at(context.scene) is None:
            cls.poll_message_set("Look through a lit photo first; click it in the list")
            return False
        return True

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        apply_strokes(scene)
        image = canvas_of(scene, capture_path(scene), looked_at(scene).place)
        show_canvas(context, image)
        prepare_brush(context, "image_paint")
        return {"FINISHED"}


class PATINA_OT_take_paint(_ScanOperator, bpy.types.Operator):
    """Apply painted strokes: strokes on photos to the mesh and the masks, strokes on the mesh to \
its material slots. Fitting and saving apply them automatically"""

    bl_idname = "patina.take_paint"
    bl_label = "Apply Paint"
    bl_options = {"REGISTER", "UNDO"}

    def _do(self, context: bpy.types.Context) -> set[str]:
        faces, pixels = apply_strokes(context.scene)
        _redraw_paint(context)
        self.report(
            {"INFO"}, f"Painted faces on the mesh: {faces:,}; painted pixels on photos: {pixels:,}."
        )
        return {"FINISHED"}


class PATINA_OT_slots_from_face_sets(_ScanOperator, bpy.types.Operator):
    """Create a material for each face set of the scanned mesh. Edit face sets in Sculpt Mode"""

    bl_idname = "patina.slots_from_face_sets"
    bl_label = "Materials from Face Sets"
    bl_options = {"REGISTER", "UNDO"}

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene, mesh = context.scene, context.scene.patina.mesh
        if mesh.mode == "SCULPT":
            with context.temp_override(active_object=mesh, object=mesh):
                bpy.ops.object.mode_set(mode="OBJECT")
        found = slots_of_face_sets(mesh)
        if found is None:
            raise PatinaError("The mesh has only one face set; create more in Sculpt Mode")
        mesh.data.materials.clear()
        scene.patina.use_slots = True
        for _ in range(int(found.max()) + 1):
            new_slot(scene, capture_path(scene), "")
        assign_slots(mesh, found)
        _redraw_paint(context)
        self.report({"INFO"}, f"Materials created: {int(found.max()) + 1}.")
        return {"FINISHED"}


class PATINA_OT_export_masks(_ScanOperator, bpy.types.Operator):
    """Write the painted masks as PNG files: one for each photo and material, and one for each \
photo and kind of excluded area"""

    bl_idname = "patina.export_masks"
    bl_label = "Export Masks"

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE"})  # type: ignore[valid-type]

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.directory:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        apply_strokes(scene)
        folder = Path(bpy.path.abspath(self.directory))
        files = write_masks(scene, capture_path(scene), check_out(folder))
        self.report({"INFO"}, f"Masks written: {len(files)}, in {folder}")
        return {"FINISHED"}


def _redraw_paint(context: bpy.types.Context) -> None:
    """Redraw the canvases and the colours of the painted mesh."""
    scene, mesh = context.scene, context.scene.patina.mesh
    capture = capture_path(scene)
    for image in canvases(capture).values():
        draw(scene, capture, image)
    if shown_on_mesh(mesh):
        show_on_mesh(scene, mesh)
    update_brushes(context)


CLASSES = (
    PATINA_OT_add_material,
    PATINA_OT_remove_material,
    PATINA_OT_pick_paint,
    PATINA_OT_paint_mesh,
    PATINA_OT_paint_photo,
    PATINA_OT_take_paint,
    PATINA_OT_slots_from_face_sets,
    PATINA_OT_export_masks,
)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
