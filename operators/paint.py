"""Materials & Masks by hand: on the mesh, or on a photo, with Blender's own brushes."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.errors import PatinaError
from ..core.output_folder import check_out
from ..scene.paint.apply_paint import take_all
from ..scene.paint.brushes import ready_to_paint
from ..scene.paint.canvas import canvas_of, canvases, draw
from ..scene.paint.mask_files import write_masks
from ..scene.paint.mesh_paint import show_on_mesh, shown_on_mesh, slots_of_face_sets
from ..scene.paint.paint_kinds import paints, take_up, wear
from ..scene.photos.photo_list import looked_at
from ..scene.scan.face_slots import leave_edit_mode, new_slot
from ..scene.session.image_editor import show_canvas
from ..scene.session.scene_properties import capture_path
from .report_errors import refuse


class _OnScan:
    """Work on the scanned mesh of the capture in the scene."""

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
            return refuse(self, error)

    def _do(self, context: bpy.types.Context) -> set[str]:
        raise NotImplementedError


class PATINA_OT_add_material(_OnScan, bpy.types.Operator):
    """Add a material to the scanned mesh, with a colour of its own, to paint where it is"""

    bl_idname = "patina.add_material"
    bl_label = "Add Material"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Name", description="What the measured material will be called", maxlen=60
    )

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        number = new_slot(scene, capture_path(scene), self.name)
        scene.patina.use_slots = True
        scene.patina_paint.active = number
        _up_to_date(context)
        return {"FINISHED"}


class PATINA_OT_pick_paint(_OnScan, bpy.types.Operator):
    """Paint with this: Blender's brushes get its colour"""

    bl_idname = "patina.pick_paint"
    bl_label = "Pick Paint"
    bl_options = {"REGISTER", "UNDO"}

    number: bpy.props.IntProperty(options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]

    def _do(self, context: bpy.types.Context) -> set[str]:
        if not 0 <= self.number < len(paints(context.scene)):
            raise PatinaError(f"there is no paint number {self.number}")
        context.scene.patina_paint.active = self.number
        take_up(context)
        return {"FINISHED"}


class PATINA_OT_paint_mesh(_OnScan, bpy.types.Operator):
    """Paint materials on the mesh: seen in all photos at once. Press again to go on with it"""

    bl_idname = "patina.paint_mesh"
    bl_label = "Paint on the Mesh"
    bl_options = {"REGISTER", "UNDO"}

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene, mesh = context.scene, context.scene.patina.mesh
        if not scene.patina.use_slots or len(mesh.material_slots) < 2:
            raise PatinaError("there is one material only: add another one, to paint where it is")
        take_all(scene)
        leave_edit_mode(mesh)
        context.view_layer.objects.active = mesh
        if mesh.mode != "VERTEX_PAINT":
            with context.temp_override(active_object=mesh, object=mesh):
                bpy.ops.object.mode_set(mode="VERTEX_PAINT")
        show_on_mesh(scene, mesh)
        ready_to_paint(context, "vertex_paint")
        for area in context.screen.areas if context.screen else ():
            if area.type == "VIEW_3D":
                shading = area.spaces.active.shading
                shading.type, shading.color_type, shading.light = "SOLID", "VERTEX", "FLAT"
        return {"FINISHED"}


class PATINA_OT_paint_photo(_OnScan, bpy.types.Operator):
    """Paint materials, and what is left out, on the photo that is looked at, in an Image Editor"""

    bl_idname = "patina.paint_photo"
    bl_label = "Paint on This Photo"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if looked_at(context.scene) is None:
            cls.poll_message_set("Look through a lit photo first: click it in the list")
            return False
        return True

    def _do(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        take_all(scene)
        image = canvas_of(scene, capture_path(scene), looked_at(scene).place)
        show_canvas(context, image)
        ready_to_paint(context, "image_paint")
        return {"FINISHED"}


class PATINA_OT_take_paint(_OnScan, bpy.types.Operator):
    """Take what was painted: strokes on photos go to the mesh and to masks, those on the mesh to \
its materials. A fit and saving do so by themselves"""

    bl_idname = "patina.take_paint"
    bl_label = "Take Paint"
    bl_options = {"REGISTER", "UNDO"}

    def _do(self, context: bpy.types.Context) -> set[str]:
        faces, pixels = take_all(context.scene)
        _up_to_date(context)
        self.report({"INFO"}, f"{faces:,} faces painted on the mesh, {pixels:,} pixels on photos")
        return {"FINISHED"}


class PATINA_OT_slots_from_face_sets(_OnScan, bpy.types.Operator):
    """Make a material of each face set of the scanned mesh (Sculpt Mode: lasso, masks, islands)"""

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
            raise PatinaError("the mesh has one face set only: make some in Sculpt Mode")
        mesh.data.materials.clear()
        scene.patina.use_slots = True
        for _ in range(int(found.max()) + 1):
            new_slot(scene, capture_path(scene), "")
        wear(mesh, found)
        _up_to_date(context)
        self.report({"INFO"}, f"{int(found.max()) + 1} materials")
        return {"FINISHED"}


class PATINA_OT_export_masks(_OnScan, bpy.types.Operator):
    """Write what is painted as PNG files: a mask for each photo and material, and for what is \
left out"""

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
        take_all(scene)
        folder = Path(bpy.path.abspath(self.directory))
        files = write_masks(scene, capture_path(scene), check_out(folder))
        self.report({"INFO"}, f"{len(files)} masks in {folder}")
        return {"FINISHED"}


def _up_to_date(context: bpy.types.Context) -> None:
    """Canvases and the painted mesh show what is there now."""
    scene, mesh = context.scene, context.scene.patina.mesh
    capture = capture_path(scene)
    for image in canvases(capture).values():
        draw(scene, capture, image)
    if shown_on_mesh(mesh):
        show_on_mesh(scene, mesh)
    take_up(context)


CLASSES = (
    PATINA_OT_add_material,
    PATINA_OT_pick_paint,
    PATINA_OT_paint_mesh,
    PATINA_OT_paint_photo,
    PATINA_OT_take_paint,
    PATINA_OT_slots_from_face_sets,
    PATINA_OT_export_masks,
)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
