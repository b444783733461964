"""Masks: compute shadow masks, and propose materials on the mesh. Stepped jobs; ESC cancels."""

from __future__ import annotations

import bpy

from ..core.capture import Capture, read_capture
from ..core.concurrency.job import Job
from ..core.counted import counted
from ..core.errors import PatinaError
from ..core.masks.proposal import MOST_MATERIALS
from ..core.masks.proposal_job import ProposalJob
from ..core.masks.staged_masks import StagedMasksJob
from ..core.masks.write_masks import material_names
from ..core.output_folder import check_out
from ..scene.paint.apply_paint import apply_strokes
from ..scene.paint.mask_images import (
    masks_folder,
    shadow_images,
    show_shadow_masks,
    with_mask_images,
)
from ..scene.photos.lamps import with_dragged_lamps
from ..scene.scan.face_slots import show_proposal
from ..scene.session.existing_capture import existing_capture
from ..scene.session.overlay_shading import leave_overlay
from ..scene.session.running_job import set_running
from .stepped import Stepped


class _CaptureJob(Stepped):
    """Mixin for jobs on the scene's capture. Subclasses create the job and apply its result."""

    PANEL = "masks"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.patina.capture:
            cls.poll_message_set("Import a capture first")
            return False
        return cls.idle(context)

    def _start(self, context: bpy.types.Context) -> None:
        path = existing_capture(context.scene.patina.capture)
        apply_strokes(context.scene)
        capture, _ = with_dragged_lamps(read_capture(path), context.scene)
        self._capture = str(capture.file)
        self._scene = context.scene.name  # by name: a reference does not survive undo
        self._job = self._job_of(context.scene, capture)

    def _finish(self, context: bpy.types.Context) -> None:
        scene = bpy.data.scenes.get(self._scene)
        if scene is not None:
            self._take(scene)

    def _job_of(self, scene: bpy.types.Scene, capture: Capture) -> Job:
        raise NotImplementedError

    def _take(self, scene: bpy.types.Scene) -> None:
        raise NotImplementedError


class PATINA_OT_propose_materials(_CaptureJob, bpy.types.Operator):
    """Divide the mesh into materials that look different in the photos, as slots to paint over"""

    bl_idname = "patina.propose_materials"
    bl_label = "Propose Materials"
    bl_options = {"REGISTER", "UNDO"}

    count: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Materials",
        description="Number of materials; 0 to let the photos decide",
        min=0,
        max=MOST_MATERIALS,
    )

    def _job_of(self, scene: bpy.types.Scene, capture: Capture) -> Job:
        mesh = scene.patina.mesh
        if mesh is None or mesh.type != "MESH" or mesh.name not in scene.objects:
            raise PatinaError("The scanned mesh is not in this scene; import the capture again")
        return ProposalJob(with_mask_images(capture), self.count or None)

    def _take(self, scene: bpy.types.Scene) -> None:
        found = self._job.result.proposal
        names = material_names(found.count)
        leave_overlay()  # it would hide the proposal
        show_proposal(scene.patina.mesh, self._capture, found.labels, found.confidence, names)
        scene.patina.use_slots = found.count > 1
        if found.count == 1:
            self.report({"INFO"}, "One material found; the photos show no difference.")
        else:
            self.report(
                {"INFO"},
                f"{counted(found.count, 'material')} proposed. Paint over faces that are wrong.",
            )


class PATINA_OT_shadow_masks(_CaptureJob, bpy.types.Operator):
    """Compute where the light of each photo is blocked, as images to paint on. White areas are \
excluded from the fit"""

    bl_idname = "patina.shadow_masks"
    bl_label = "Compute Shadow Masks"
    bl_options = {"REGISTER", "UNDO"}

    replace: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Replace",
        description="Recompute existing masks; what was painted on them is lost",
        options={"SKIP_SAVE"},
    )

    def _job_of(self, scene: bpy.types.Scene, capture: Capture) -> Job:
        if shadow_images(self._capture) and not self.replace:
            raise PatinaError("There are shadow masks already; enable Replace to overwrite them")
        self._photos = capture.photos
        return StagedMasksJob(capture, check_out(masks_folder(capture.file)))

    def _take(self, scene: bpy.types.Scene) -> None:
        out = self._job.out
        files = [out / name for name in self._job.result.shadows]
        names = [photo.file.name for photo in self._photos]
        show_shadow_masks(scene, self._capture, names, files)
        for note in self._job.notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, f"Shadow masks written: {len(files)}, in {out}")


CLASSES = (PATINA_OT_propose_materials, PATINA_OT_shadow_masks)
register, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def unregister() -> None:
    """Remove the classes and the status line."""
    set_running(None)
    _unregister_classes()
