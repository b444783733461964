"""Scan stage: add files to the draft of a new capture (a stepped job)."""

from __future__ import annotations

import os
import textwrap
from pathlib import Path

import bpy

from ...core.errors import InputError
from ...core.new_capture import Draft, DraftJob
from ...scene.scan.capture_draft import draft_of, store_draft
from ..report_errors import call_operator
from ..stepped import Stepped

HINT = (
    "Open the folder with cameras, mesh and photos, and press New Capture. Or select files; more "
    "can be added later."
)
HINT_WIDTH = 32  # characters per line beside the file browser


class PATINA_OT_add_files(Stepped, bpy.types.Operator):
    """Choose cameras, mesh and photos, or the folder that holds them. Each file is recognised by \
its content; nothing is imported yet"""

    bl_idname = "patina.add_files"
    bl_label = "New Capture"
    PANEL = "scan"
    bl_options = {"REGISTER", "UNDO"}
    CANCELLED = "Cancelled; the new capture was not changed."

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE", "HIDDEN"})  # type: ignore[valid-type]
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})  # type: ignore[valid-type]
    files: bpy.props.CollectionProperty(  # type: ignore[valid-type]
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"}
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.idle(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if getattr(self, "_picked", False):  # confirmed in the file browser: continue in steps
            chosen = {
                "filepath": self.filepath,
                "directory": self.directory,
                "files": [{"name": one.name} for one in self.files],
            }
            return call_operator(self, bpy.ops.patina.add_files, "INVOKE_DEFAULT", **chosen)
        return super().execute(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self._paths():
            self._picked = True
            folder = draft_of(context.scene).folder  # the browser opens there
            if folder is not None:
                self.directory = str(folder) + os.sep
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return super().invoke(context, event)

    def draw(self, context: bpy.types.Context) -> None:
        for line in textwrap.wrap(HINT, HINT_WIDTH):
            self.layout.label(text=line)

    def _paths(self) -> list[Path]:
        folder = Path(bpy.path.abspath(self.directory)) if self.directory else None
        chosen = [folder / one.name for one in self.files if one.name and folder is not None]
        if not chosen and self.filepath and Path(bpy.path.abspath(self.filepath)).exists():
            chosen = [Path(bpy.path.abspath(self.filepath))]
        return chosen or ([folder] if folder is not None else [])

    def _start(self, context: bpy.types.Context) -> None:
        paths = self._paths()
        if not paths:
            raise InputError("no file is chosen; choose files or a folder", key="files")
        state = context.scene.patina_draft
        before = draft_of(context.scene) if state.is_open else Draft()
        self._job = DraftJob(paths, before)
        self._scene = context.scene.name  # by name: a reference does not survive undo

    def _finish(self, context: bpy.types.Context) -> None:
        draft, scene = self._job.draft, bpy.data.scenes.get(self._scene)
        if draft is None or scene is None:
            return
        store_draft(scene, draft)
        for problem in draft.problems:
            self.report({"WARNING"}, problem)
        for sentence in draft.found:
            self.report({"INFO"}, sentence)


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_add_files,))
