"""Check stage: find what the model does not explain in the photos, and name the causes. Runs in
steps, as the fit does."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ..core.counted import counted
from ..core.diagnose.effects.labels import cause_label
from ..core.diagnose.selection.effect_subset import correctable_effects
from ..core.jobs import CaptureResult
from ..core.jobs.check_job import CheckJob
from ..core.jobs.refit_job import RefitJob
from ..core.jobs.varying_second_fit import VaryingSecondFit
from ..core.report.diagnosis_json import describe
from ..scene.scan.evidence_colours import paint_evidence
from ..scene.session.last_diagnosis import keep_check, kept_check
from ..scene.session.running_job import set_running
from ..scene.session.scene_properties import (
    DIAGNOSIS,
    RESULT,
    capture_path,
    store_result,
)
from ..scene.views.evidence_overlay import toggle_evidence
from ..scene.views.outdated import inputs_now, record_inputs
from .fit import can_fit, fit_job, prepared, show_result
from .stepped import Stepped


class PATINA_OT_check(Stepped, bpy.types.Operator):
    """Fit the materials, find what scan, lights and materials do not explain in the photos, name \
the causes, and fit again with these causes included in the model"""

    bl_idname = "patina.check"
    bl_label = "Check"
    PANEL = "check"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return can_fit(cls, context)

    def _start(self, context: bpy.types.Context) -> None:
        keep_check(None)  # the samples of two checks would need too much memory
        self._job = prepared(_varying(CheckJob(fit_job(self, context.scene)), context.scene))
        self._inputs = inputs_now(context.scene)
        self._scene = context.scene.name

    def _finish(self, context: bpy.types.Context) -> Iterator[None]:
        checked, after = self._job.job.checked, self._job.result
        found, diagnosis_context, before = checked.found, checked.context, checked.result
        assessment = checked.assessment
        scene = bpy.data.scenes.get(self._scene)
        if (
            found is None
            or assessment is None
            or diagnosis_context is None
            or before is None
            or after is None
            or scene is None
        ):
            self.report({"WARNING"}, "The scene no longer exists; the result was discarded.")
            return
        keep_check(checked)
        scene.patina.causes.clear()
        applied = {effect.cause for effect in after.effects}
        for trial in correctable_effects(found):
            cause = scene.patina.causes.add()
            cause.name, cause.use = trial.effect.cause, trial.effect.cause in applied
        yield from _show(self, scene, after)
        store_result(
            str(before.capture.file), describe(found, assessment, before, after), DIAGNOSIS
        )
        yield
        mesh, vertices = scene.patina.mesh, diagnosis_context.rays.mesh.vertices
        if mesh is not None and not paint_evidence(mesh, vertices, diagnosis_context.pixels, found):
            self.report(
                {"WARNING"},
                f"{mesh.name} no longer has the vertices of the scan, so it was not coloured.",
            )
        for kind in (RESULT, DIAGNOSIS):
            record_inputs(scene, kind, self._inputs)
        for trial in found.reported:
            self.report({"WARNING"}, f"{cause_label(trial.effect.cause)}: {found.sentence(trial)}")
        if not found.causes:
            self.report({"INFO"}, "No known cause found.")


class PATINA_OT_refit(Stepped, bpy.types.Operator):
    """Fit the materials again, with only the enabled causes included in the model"""

    bl_idname = "patina.refit"
    bl_label = "Fit Again"
    PANEL = "check"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if kept_check(capture_path(context.scene)) is None:
            cls.poll_message_set(
                "Run Check first; its samples are kept only until Blender is closed"
            )
            return False
        return cls.idle(context)

    def _start(self, context: bpy.types.Context) -> None:
        off = [cause.name for cause in context.scene.patina.causes if not cause.use]
        refit = RefitJob(kept_check(capture_path(context.scene)), without=off, exactly=True)
        self._job = prepared(_varying(refit, context.scene))
        self._basis_source = None  # that of the check
        self._inputs = inputs_now(context.scene)
        self._scene = context.scene.name

    def _finish(self, context: bpy.types.Context) -> Iterator[None]:
        checked, after = self._job.job.checked, self._job.result
        scene = bpy.data.scenes.get(self._scene)
        found, assessment, before = checked.found, checked.assessment, checked.result
        if after is None or scene is None or before is None or found is None or assessment is None:
            self.report({"WARNING"}, "The scene no longer exists; the materials were not applied.")
            return
        yield from _show(self, scene, after)
        description = describe(found, assessment, before, after)
        store_result(str(after.capture.file), description, DIAGNOSIS)
        for kind in (RESULT, DIAGNOSIS):
            record_inputs(scene, kind, self._inputs)


def _varying(
    second: CheckJob | RefitJob, scene: bpy.types.Scene
) -> CheckJob | RefitJob | VaryingSecondFit:
    """The job, with the variation of the materials unless the scene's settings exclude it."""
    mode = scene.patina.varying
    return second if mode == "never" else VaryingSecondFit(second, mode)


def _show(operator: Stepped, scene: bpy.types.Scene, result: CaptureResult) -> Iterator[None]:
    """Assign the materials to the mesh, and report which effects the fit included."""
    yield from show_result(operator, scene, result)
    used = ", ".join(cause_label(effect.cause).lower() for effect in result.effects)
    model = f"with {used} included in the model" if used else "without additional causes"
    operator.report({"INFO"}, f"{counted(len(result.materials), 'material')} fitted, {model}.")


def has_scanned_mesh(cls: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the scanned mesh is in the scene; of polls."""
    mesh = context.scene.patina.mesh
    if mesh is None or mesh.name not in context.scene.objects:
        cls.poll_message_set("The scanned mesh is not in this scene")
        return False
    return True


class PATINA_OT_show_evidence(bpy.types.Operator):
    """Colour the scanned mesh by the change that this cause makes in the photos: blue where they \
get darker, red where they get brighter. Press again to return to the earlier shading"""

    bl_idname = "patina.show_evidence"
    bl_label = "Show Where"
    bl_options = {"REGISTER", "UNDO"}

    cause: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_scanned_mesh(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if toggle_evidence(context.scene.patina.mesh, self.cause) is None:
            self.report(
                {"WARNING"},
                f"The mesh has no colours for {cause_label(self.cause)}. Run Check again.",
            )
            return {"CANCELLED"}
        return {"FINISHED"}


CLASSES = (PATINA_OT_check, PATINA_OT_refit, PATINA_OT_show_evidence)
register, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def unregister() -> None:
    """Remove the classes and the status line."""
    set_running(None)
    _unregister_classes()
