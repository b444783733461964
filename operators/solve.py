"""Solve stage: cameras and sparse points from a folder of photos; a stepped job, ESC cancels."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.errors import InputError
from ..core.output_folder import check_out, staged_folder
from ..core.scan.readers.colmap import read_colmap
from ..core.solve import SolveJob
from ..core.solve.solution import MODEL
from ..core.solve.solve import LENSES
from ..scene.scan.scan_collection import create_reconstruction
from ..scene.session.folders import rectified_folder
from .report_errors import hand_on
from .stepped import Stepped


class PATINA_OT_solve_photos(Stepped, bpy.types.Operator):
    """Find the cameras of a folder of photos, and points of the surface they show"""

    bl_idname = "patina.solve_photos"
    bl_label = "Solve Photos"
    PANEL = "scan"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    TICK = 0.1
    ALONGSIDE = False
    CANCELLED = "Solving cancelled; nothing was written"

    directory: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Photos",
        description="The folder of the photos",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    out: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Results",
        description="Folder for the model and a capture file to go on from. "
        "Empty: one beside the folder of photos, of its name and 'solved'",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    lens: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Lens",
        description="Which distortion the lens may have",
        items=[(name, name.replace("_", " ").title(), "") for name in LENSES],
        default=LENSES[0],
    )
    threads: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Threads", description="At most so many. 0: one for each core", min=0, max=1024
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.idle(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if getattr(self, "_picked", False):  # in the file browser: go on in steps
            told = {name: getattr(self, name) for name in ("directory", "out", "lens", "threads")}
            return hand_on(self, bpy.ops.patina.solve_photos, "INVOKE_DEFAULT", **told)
        return super().execute(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.directory:
            self._picked = True
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return super().invoke(context, event)

    def _start(self, context: bpy.types.Context) -> None:
        if not self.directory:
            raise InputError("say which folder the photos lie in", key="directory")
        self._photos = Path(bpy.path.abspath(self.directory)).resolve()
        beside = self._photos.with_name(f"{self._photos.name} solved")
        self._out = check_out(Path(bpy.path.abspath(self.out)) if self.out else beside)
        self._job = SolveJob(self._photos, self.lens, self.threads or None)
        self._scene = context.scene.name  # by name: a reference does not survive undo

    def _stop(self, context: bpy.types.Context) -> None:
        if self._job is not None:
            self._job.cancel()
        super()._stop(context)

    def _finish(self, context: bpy.types.Context) -> None:
        solution = self._job.solution
        with staged_folder(self._out) as folder:
            capture = solution.write(folder, self._out, self._photos)
        self.report({"INFO"}, f"{solution.summary()}; wrote {self._out / capture.name}")
        missing = solution.photos - solution.placed
        if missing:
            self.report({"WARNING"}, f"{missing} photos have no pose; report.txt says why")
        scene = bpy.data.scenes.get(self._scene)
        if scene is None:
            self.report({"WARNING"}, "The scene is gone; the cameras lie in the files only")
            return
        # without the photos behind them: straightening each would take seconds in one piece
        found = read_colmap(self._out / MODEL)
        create_reconstruction(scene, self._photos.name, found, None, rectified_folder(capture))


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_solve_photos,))
