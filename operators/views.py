"""Charts of a measured material and comparisons with a photo, shown in an Image Editor."""

from __future__ import annotations

import bpy

from ..core.errors import PatinaError
from ..scene.material.measured_materials import measured_of
from ..scene.photos.photo_list import looked_at as photo_of
from ..scene.session.image_editor import show_image
from ..scene.session.scene_properties import capture_path, stored_result
from ..scene.views.photo_comparison import look_job, show_photo_view
from ..scene.views.view_properties import looked_at, show_chart
from .fit import fit_job
from .report_errors import report_and_cancel
from .stepped import Stepped

ITEMS = (
    ("sphere", "Lit Sphere", "A sphere of the material under a key light and a rim light"),
    ("polar", "Polar Slice", "Reflectance in the plane of incidence, with the samples near it"),
    ("highlight", "Highlight", "Reflectance over the angle between half vector and normal, with "
     "the samples near it"),
    ("slice", "Image Slice", "The BRDF over half and difference angle, with the samples"),
    ("interval", "Uncertainty", "Uncertainty of the BRDF over half and difference angle"),
    ("ratio", "Ratio", "The BRDF to compare with, divided by that of the material"),
)  # fmt: skip

PHOTO_ITEMS = (
    ("comparison", "Photo and Prediction", "The photo, the prediction of the fitted materials, and "
     "the signed difference"),
    ("samples", "Sampled Pixels", "The pixels that were measured, and the criteria that excluded "
     "the others"),
)  # fmt: skip


class PATINA_OT_show_chart(bpy.types.Operator):
    """Draw a chart of the measured material, with its samples and its 90 % interval, and show it \
in an Image Editor"""

    bl_idname = "patina.show_chart"
    bl_label = "Show Chart"
    bl_options = {"REGISTER", "UNDO"}

    kind: bpy.props.EnumProperty(name="Chart", items=ITEMS)  # type: ignore[valid-type]

    @classmethod
    def description(cls, context: bpy.types.Context, properties: object) -> str:
        return next(tooltip for key, _, tooltip in ITEMS if key == properties.kind)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if looked_at(context) is None:
            cls.poll_message_set("Fit first; there is no measured material in this file")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            image = show_chart(context, self.kind)
        except PatinaError as error:
            return report_and_cancel(self, error)
        show_image(context, image)
        return {"FINISHED"}


class PATINA_OT_look_at_photo(Stepped, bpy.types.Operator):
    """Show the active photo with its prediction, or the pixels that were sampled in it"""

    bl_idname = "patina.look_at_photo"
    bl_label = "Show Photo"
    PANEL = "check"
    bl_options = {"REGISTER", "UNDO"}

    kind: bpy.props.EnumProperty(name="View", items=PHOTO_ITEMS)  # type: ignore[valid-type]

    @classmethod
    def description(cls, context: bpy.types.Context, properties: object) -> str:
        return next(tooltip for key, _, tooltip in PHOTO_ITEMS if key == properties.kind)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if photo_of(context.scene) is None:
            cls.poll_message_set("Look through the camera of a lit photo first (Photos & Light)")
            return False
        if not measured_of(capture_path(context.scene)):
            cls.poll_message_set("Fit first; this capture has no measured material in this file")
            return False
        return cls.idle(context)

    def _start(self, context: bpy.types.Context) -> None:
        scene = context.scene
        self._job = look_job(scene, fit_job(self, scene), photo_of(scene).place)
        self._scene = scene.name

    def _finish(self, context: bpy.types.Context) -> None:
        scene = bpy.data.scenes.get(self._scene)
        if scene is None or self._job.view is None:
            self.report({"WARNING"}, "The scene no longer exists; the view was not drawn.")
            return
        exposure = scene.patina_views.exposure
        image = show_photo_view(context, self._job.view, self.kind, exposure)
        scene.patina_views.shown = self.kind
        show_image(context, image)
        stored = stored_result(capture_path(scene)) or {}
        if stored.get("varying") and self._job.known is None:
            self.report(
                {"WARNING"},
                "The materials vary over the surface, but the prediction shows them as even: the "
                "variation is kept in memory only until Blender is closed. Fit again to see it.",
            )


CLASSES = (PATINA_OT_show_chart, PATINA_OT_look_at_photo)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
