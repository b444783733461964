"""Scan stage: find cameras and sparse points from a folder of photos (a stepped job)."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.errors import InputError
from ..core.scan.readers.colmap import read_colmap
from ..core.solve import SolveToFolderJob
from ..core.solve.solution import MODEL
from ..core.solve.solve import LENSES
from ..scene.scan.orientation import set_upright
from ..scene.scan.scan_collection import create_reconstruction
from ..scene.session.folders import rectified_folder
from .report_errors import call_operator
from .stepped import Stepped

LENS_LABELS = {
    "SIMPLE_RADIAL": "Simple Radial",
    "RADIAL": "Radial",
    "OPENCV": "OpenCV",
    "OPENCV_FISHEYE": "OpenCV Fisheye",
    "SIMPLE_PINHOLE": "Simple Pinhole",
    "PINHOLE": "Pinhole",
}  # lens models of COLMAP


class PATINA_OT_solve_photos(Stepped, bpy.types.Operator):
    """Find the cameras of the photos in a folder, and sparse points of the surface"""

    bl_idname = "patina.solve_photos"
    bl_label = "Solve Photos"
    PANEL = "scan"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    CANCELLED = "Solving cancelled; nothing was written."

    directory: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Photos",
        description="Folder of the photos",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    out: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Results",
        description="Folder for the camera model and a draft of the capture file. If empty, a "
        "folder next to that of the photos, with its name followed by 'solved'",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    lens: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Lens",
        description="Distortion model of the lens",
        items=[(name, label, "") for name, label in LENS_LABELS.items()],
        default=LENSES[0],
    )
    threads: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Threads", description="Maximum number of threads; 0 for one per core", min=0, max=1024
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.idle(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if getattr(self, "_picked", False):  # confirmed in the file browser: continue in steps
            chosen = {name: getattr(self, name) for name in ("directory", "out", "lens", "threads")}
            return call_operator(self, bpy.ops.patina.solve_photos, "INVOKE_DEFAULT", **chosen)
        return super().execute(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.directory:
            self._picked = True
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return super().invoke(context, event)

    def _start(self, context: bpy.types.Context) -> None:
        if not self.directory:
            raise InputError("no folder given; choose the folder of the photos", key="directory")
        self._photos = Path(bpy.path.abspath(self.directory)).resolve()
        default_out = self._photos.with_name(f"{self._photos.name} solved")
        out = Path(bpy.path.abspath(self.out)) if self.out else default_out
        self._job = SolveToFolderJob(self._photos, out, self.lens, self.threads or None)
        self._scene = context.scene.name  # by name: a reference does not survive undo

    def _finish(self, context: bpy.types.Context) -> None:
        job = self._job
        for note in job.notes:
            self.report({"INFO"}, note)
        self.report({"INFO"}, f"{job.summary}. Written: {job.capture}")
        if job.missing:
            self.report(
                {"WARNING"},
                f"Photos without a pose: {job.missing}. See report.txt for the reasons.",
            )
        scene = bpy.data.scenes.get(self._scene)
        if scene is None:
            self.report(
                {"WARNING"},
                "The scene no longer exists; the cameras are in the written files only.",
            )
            return
        # without photos behind the cameras: undistorting each would block Blender for seconds
        found = read_colmap(job.out / MODEL)
        create_reconstruction(scene, self._photos.name, found, None, rectified_folder(job.capture))
        set_upright(scene)


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_solve_photos,))
