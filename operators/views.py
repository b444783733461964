"""Charts of a measured material and looks at a photo, shown in an Image Editor."""

from __future__ import annotations

import bpy

from ..core.errors import PatinaError
from ..scene.material.measured_materials import measured_of
from ..scene.photos.photo_list import looked_at as photo_of
from ..scene.session.image_editor import show_image
from ..scene.session.scene_properties import capture_path
from ..scene.views.photo_comparison import look_job, show_photo_view
from ..scene.views.view_properties import looked_at, show_chart
from .fit import fit_job
from .report_errors import refuse
from .stepped import Stepped

ITEMS = (
    ("sphere", "Lit Sphere", "Under a key light and a rim light"),
    ("polar", "Polar Slice", "Reflectance in the plane of incidence, with what was measured there"),
    ("highlight", "Highlight", "Reflectance against the half vector's angle, with what was "
     "measured there"),
    ("slice", "Image Slice", "The BRDF over half and difference angle, and the samples"),
    ("interval", "Certainty", "How far off the BRDF may be, over half and difference angle"),
    ("ratio", "Ratio", "The BRDF that it is compared with, divided by this one"),
)  # fmt: skip

PHOTO_ITEMS = (
    ("comparison", "Photo and Prediction", "The photo, what the materials predict for it, and the "
     "signed difference"),
    ("samples", "Where Samples Came From", "Which pixels were measured, and by which criterion the "
     "others were left out"),
)  # fmt: skip


class PATINA_OT_show_chart(bpy.types.Operator):
    """Draw this of the measured material, with its samples and its 90 % interval, and show it in \
an Image Editor"""

    bl_idname = "patina.show_chart"
    bl_label = "Show Chart"
    bl_options = {"REGISTER", "UNDO"}

    kind: bpy.props.EnumProperty(name="Chart", items=ITEMS)  # type: ignore[valid-type]

    @classmethod
    def description(cls, context: bpy.types.Context, properties: object) -> str:
        return next(said for key, _, said in ITEMS if key == properties.kind)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if looked_at(context) is None:
            cls.poll_message_set("Fit first: there is no measured material in this file")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            image = show_chart(context, self.kind)
        except PatinaError as error:
            return refuse(self, error)
        show_image(context, image)
        return {"FINISHED"}


class PATINA_OT_look_at_photo(Stepped, bpy.types.Operator):
    """Look at the photo whose camera is looked through: beside its prediction, or where samples \
came from"""

    bl_idname = "patina.look_at_photo"
    bl_label = "Look at Photo"
    PANEL = "check"
    bl_options = {"REGISTER", "UNDO"}

    kind: bpy.props.EnumProperty(name="View", items=PHOTO_ITEMS)  # type: ignore[valid-type]

    @classmethod
    def description(cls, context: bpy.types.Context, properties: object) -> str:
        return next(said for key, _, said in PHOTO_ITEMS if key == properties.kind)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if photo_of(context.scene) is None:
            cls.poll_message_set("Look through a lit photo's camera first: Photos & Light")
            return False
        if not measured_of(capture_path(context.scene)):
            cls.poll_message_set("Fit first: this capture has no measured material in this file")
            return False
        return cls.idle(context)

    def _start(self, context: bpy.types.Context) -> None:
        scene = context.scene
        self._job = look_job(scene, fit_job(self, scene), photo_of(scene).place)
        self._scene = scene.name

    def _finish(self, context: bpy.types.Context) -> None:
        scene = bpy.data.scenes.get(self._scene)
        if scene is None or self._job.view is None:
            self.report({"WARNING"}, "The scene is gone; the photo was not looked at")
            return
        exposure = scene.patina_views.exposure
        image = show_photo_view(context, self._job.view, self.kind, exposure)
        scene.patina_views.shown = self.kind
        show_image(context, image)


CLASSES = (PATINA_OT_show_chart, PATINA_OT_look_at_photo)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
