"""Fit stage: a stepped job. Scripts run it to the end at once, a window steps it on a timer; ESC
cancels."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ..core.capture import read_capture
from ..core.counted import counted
from ..core.jobs import CaptureResult, FitJob
from ..core.jobs.varying.varying_job import VaryingJob
from ..core.samples import Margins
from ..core.views.prepared_materials import Fitting, PreparedJob
from ..scene.material.file_cache import basis_source, keep_basis, own_basis, trim_cache
from ..scene.material.material_nodes import osl_missing
from ..scene.paint.apply_paint import apply_strokes
from ..scene.paint.mask_images import with_mask_images
from ..scene.photos.dragged_lamps import lamp_of
from ..scene.photos.lamps import with_dragged_lamps
from ..scene.scan.apply_result import apply_result_steps
from ..scene.scan.face_slots import with_painted_slots
from ..scene.session.existing_capture import existing_capture
from ..scene.session.last_fit import keep_fit
from ..scene.session.overlay_shading import leave_overlay
from ..scene.session.preferences import preferences
from ..scene.session.running_job import set_running
from ..scene.views.outdated import inputs_now, record_inputs
from .stepped import Stepped


def can_fit(operator: type[Stepped], context: bpy.types.Context) -> bool:
    """Whether a fit can start: a capture is open and no job runs. Sets the poll message if not."""
    if not context.scene.patina.capture:
        operator.poll_message_set("Import a capture first; it lists the photos to measure")
        return False
    return operator.idle(context)


def fit_job(operator: bpy.types.Operator, scene: bpy.types.Scene) -> FitJob:
    """The fit of the scene's capture, with the lamps that the user moved and the slots and masks
    that were painted. Raises InputError if the capture file does not exist."""
    path = existing_capture(scene.patina.capture)
    margins = preferences().margins
    capture, dragged = with_dragged_lamps(read_capture(path, margins), scene)
    if capture.fit.margins != Margins():
        margins = ", ".join(
            f"{name} {value:g}" for name, value in vars(capture.fit.margins).items()
        )
        operator.report({"INFO"}, f"Margins set by capture and preferences: {margins}.")
    if dragged:
        operator.report({"INFO"}, f"Lights taken from edited lamps: {', '.join(dragged)}.")
    lost = [entry.name for entry in capture.lights if not lamp_of(scene, str(path), entry.name)]
    if lost:
        operator.report(
            {"WARNING"},
            f"No lamp in the scene for {', '.join(lost)}: the fit uses the light of the capture "
            "file. Undo the deletion, or import the capture again",
        )
    apply_strokes(scene)
    capture, prepare = with_painted_slots(with_mask_images(capture), scene)
    operator._basis_source = basis_source()
    return FitJob(capture, own_basis(), prepare)


def prepared(job: Fitting) -> PreparedJob:
    """The job, followed by the preparation of its materials for this Blender."""
    return PreparedJob(job, with_osl=osl_missing() is None)


def show_result(operator: Stepped, scene: bpy.types.Scene, result: CaptureResult) -> Iterator[None]:
    """Assign the materials to the mesh, one piece per yield, and report their warnings."""
    job = operator._job
    leave_overlay()
    notes = yield from apply_result_steps(scene, result, job.stages, job.prepared, job.colours)
    yield
    scene.patina_photos.mesh_over = 1.0  # the fitted material is shown, not the photo over it
    keep_fit(result)
    if operator._basis_source is not None:
        keep_basis(operator._basis_source, result.basis)
    trim_cache()
    for material in result.materials:
        for warning in material.warnings:
            operator.report({"WARNING"}, f"{material.name}: {warning}")
    for note in notes:
        operator.report({"WARNING"}, note)


class PATINA_OT_fit(Stepped, bpy.types.Operator):
    """Measure the materials: sample every lit photo and fit a BRDF to each material"""

    bl_idname = "patina.fit"
    bl_label = "Fit Materials"
    PANEL = "fit"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return can_fit(cls, context)

    def _start(self, context: bpy.types.Context) -> None:
        fit, varying = fit_job(self, context.scene), context.scene.patina.varying
        self._job = prepared(fit if varying == "never" else VaryingJob(fit, varying))
        self._inputs = inputs_now(context.scene)
        self._scene = context.scene.name  # by name: a reference does not survive undo

    def _finish(self, context: bpy.types.Context) -> Iterator[None]:
        result = self._job.result
        if result is None:
            return
        scene = bpy.data.scenes.get(self._scene)
        if scene is None:
            self.report({"WARNING"}, "The scene no longer exists; the materials were not applied.")
            return
        yield from show_result(self, scene, result)
        record_inputs(scene, at_start=self._inputs)
        self.report({"INFO"}, f"{counted(len(result.materials), 'material')} measured.")


register, _unregister_classes = bpy.utils.register_classes_factory((PATINA_OT_fit,))


def unregister() -> None:
    """Remove the classes and the status line."""
    set_running(None)
    _unregister_classes()
