"""Check stage: what the photos show that the model does not, and why. Stepped as the fit is."""

from __future__ import annotations

import bpy

from ..core.job.diagnose_job import DiagnoseJob
from ..core.report.diagnosis import describe
from ..scene.evidence import paint_evidence, show_evidence
from ..scene.properties import DIAGNOSIS, store_result
from ..scene.running import tell
from .fit import can_fit, fit_job
from .stepped import Stepped


class PATINA_OT_check(Stepped, bpy.types.Operator):
    """Fit the materials, then find what the photos show that scan, light and materials do not \
explain, and name the cause"""

    bl_idname = "patina.check"
    bl_label = "Check"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return can_fit(cls, context)

    def _start(self, context: bpy.types.Context) -> None:
        self._job = DiagnoseJob(fit_job(self, context.scene))
        self._scene = context.scene.name

    def _finish(self, context: bpy.types.Context) -> None:
        found, setting, result = self._job.found, self._job.setting, self._job.result
        scene = bpy.data.scenes.get(self._scene)
        if found is None or setting is None or result is None or scene is None:
            self.report({"WARNING"}, "The scene is gone; nothing was kept")
            return
        store_result(str(result.capture.file), describe(found), DIAGNOSIS)
        mesh, vertices = scene.patina.mesh, setting.rays.mesh.vertices
        if mesh is not None and not paint_evidence(mesh, vertices, setting.pixels, found):
            self.report({"WARNING"}, f"{mesh.name} no longer has the scan's vertices: not coloured")
        for trial in found.accepted:
            self.report({"WARNING"}, f"{trial.effect.cause}: {trial.sentence()}")
        if not found.causes:
            self.report({"INFO"}, "Nothing that can be named is wrong")


class PATINA_OT_show_evidence(bpy.types.Operator):
    """Colour the scanned mesh by what this changes in the photos: blue darker, red brighter"""

    bl_idname = "patina.show_evidence"
    bl_label = "Show Where"
    bl_options = {"REGISTER", "UNDO"}

    cause: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        mesh = context.scene.patina.mesh
        if mesh is None or mesh.name not in context.scene.objects:
            cls.poll_message_set("The scanned mesh is not in this scene")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        if not show_evidence(context.scene.patina.mesh, self.cause):
            self.report({"WARNING"}, f"Nothing is kept of {self.cause}: run Check again")
            return {"CANCELLED"}
        for area in context.screen.areas if context.screen else ():
            if area.type == "VIEW_3D":
                shading = area.spaces.active.shading
                shading.type, shading.color_type, shading.light = "SOLID", "VERTEX", "FLAT"
        return {"FINISHED"}


CLASSES = (PATINA_OT_check, PATINA_OT_show_evidence)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    tell(None)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
