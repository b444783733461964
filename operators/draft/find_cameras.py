"""Scan stage: cameras that a new capture lacks, solved from its photos or localised in the scan."""

from __future__ import annotations

import os
from pathlib import Path

import bpy

from ...core.errors import InputError
from ...core.new_capture import LocaliseDraftJob, SolveDraftJob
from ...scene.scan.capture_draft import draft_of, store_draft
from ...scene.session.folders import own_folder
from ..stepped import Stepped

LOCALISED = "localised{}.cameras.json"  # next to the mesh; a number where the name exists


class DraftStep(Stepped):
    """A job whose ``draft`` replaces that of the scene."""

    PANEL = "scan"

    def _finish(self, context: bpy.types.Context) -> None:
        draft, scene = self._job.draft, bpy.data.scenes.get(self._scene)
        if draft is None or scene is None:
            return
        before = len(draft_of(scene).found)
        store_draft(scene, draft)
        for problem in draft.problems:
            self.report({"WARNING"}, problem)
        for sentence in draft.found[before:]:
            self.report({"INFO"}, sentence)


class PATINA_OT_solve_draft(DraftStep, bpy.types.Operator):
    """Find the cameras of the photos in a folder by comparing their details. The photos of other \
folders are then matched to these cameras"""

    bl_idname = "patina.solve_draft"
    bl_label = "Solve Cameras"
    bl_options = {"REGISTER", "UNDO"}
    CANCELLED = "Solving cancelled; nothing was written."

    folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Photos",
        description="Folder of the photos to solve",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.idle(context)

    def _start(self, context: bpy.types.Context) -> None:
        if not self.folder:
            raise InputError("no folder given; choose the folder of the photos", key="folder")
        folder = Path(bpy.path.abspath(self.folder))
        out = None
        if not os.access(folder.parent, os.W_OK):
            out = own_folder() / f"{folder.name} solved"
        self._job = SolveDraftJob(draft_of(context.scene), folder, out)
        self._scene = context.scene.name  # by name: a reference does not survive undo

    def _finish(self, context: bpy.types.Context) -> None:
        self.report({"INFO"}, f"{self._job.summary}. Written: {self._job.out}")
        super()._finish(context)


class PATINA_OT_localise_draft(DraftStep, bpy.types.Operator):
    """Find the cameras of photos from new viewpoints, by comparing their details with the photos \
of the scan"""

    bl_idname = "patina.localise_draft"
    bl_label = "Localise Photos"
    bl_options = {"REGISTER", "UNDO"}
    CANCELLED = "Cancelled; the new capture was not changed."

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if draft_of(context.scene).images is None:
            cls.poll_message_set("Add the folder of the scan's own photos first")
            return False
        return cls.idle(context)

    def _start(self, context: bpy.types.Context) -> None:
        draft = draft_of(context.scene)
        assert draft.mesh is not None  # the panel shows the button with a mesh
        folder = draft.mesh.parent
        if not os.access(folder, os.W_OK):
            folder = own_folder()
        self._job = LocaliseDraftJob(draft, _free_file(folder))
        self._scene = context.scene.name  # by name: a reference does not survive undo


def _free_file(folder: Path) -> Path:
    number = 1
    while (out := folder / LOCALISED.format("" if number == 1 else f" {number}")).exists():
        number += 1
    return out


CLASSES = (PATINA_OT_solve_draft, PATINA_OT_localise_draft)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
