"""Scan stage: write the new capture and import it."""

from __future__ import annotations

import os

import bpy

from ...core.capture.new_capture import free_name
from ...core.errors import PatinaError
from ...scene.scan.capture_draft import clear_draft, draft_of
from ...scene.session.folders import own_folder
from ..import_capture import import_written
from ..report_errors import report_and_cancel


class PATINA_OT_create_capture(bpy.types.Operator):
    """Write the capture file next to the mesh, and import it"""

    bl_idname = "patina.create_capture"
    bl_label = "Create Capture"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        missing = draft_of(context.scene).missing
        if missing is not None:
            cls.poll_message_set(missing)
        return missing is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        draft = draft_of(context.scene)
        assert draft.mesh is not None  # checked by poll
        folder = draft.mesh.parent
        if not os.access(folder, os.W_OK):
            folder = own_folder()
        out = free_name(folder, draft.mesh.resolve().parent.name or "scan")
        try:
            draft.write(out)
        except PatinaError as error:
            return report_and_cancel(self, error)
        done = import_written(self, context, out)
        if done == {"FINISHED"}:
            clear_draft(context.scene)
        return done


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_create_capture,))
