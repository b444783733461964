"""Write a capture, or a whole result, as a .blend of its own (headless)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ..core.capture import Capture
from ..core.job import CaptureResult, Stage
from ..core.scan import Scan
from . import materials, osl_files
from .apply import apply_result, measured_materials
from .scan_collection import ScanCollection, create_scan_collection


def write_import(path: Path, capture: Capture, scan: Scan) -> None:
    """Mesh, cameras with photos, lights. Rectified photos lie in photos/ beside the file."""
    _imported(path, capture, scan)
    _save(path)


def write_blend(
    path: Path, final: Path, result: CaptureResult, stages: Sequence[Stage]
) -> list[str]:
    """The same with the fitted materials on the mesh; returns notes for the user.

    final: where the file will be moved to; what lies beside it is pointed at there.
    """
    _imported(path, result.capture, result.scan)
    _save(path)  # the components' EXR goes beside a saved file
    notes = apply_result(bpy.context.scene, result, stages)
    for material in measured_materials():
        for node in osl_files.script_nodes(material):
            socket = node.inputs[osl_files.SOCKET]
            moved = final.absolute().parent / Path(socket.default_value).name
            socket.default_value = moved.as_posix()
    _save(path)
    return notes


def _imported(path: Path, capture: Capture, scan: Scan) -> ScanCollection:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True, load_ui=False)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("Black")
    if hasattr(scene.world, "use_nodes"):
        scene.world.use_nodes = True
    background = scene.world.node_tree.nodes.get("Background")
    if background is not None:
        background.inputs["Strength"].default_value = 0.0
    if hasattr(scene, "cycles"):
        scene.render.engine = "CYCLES"
        scene.cycles.samples = 64
        if materials.osl_missing() is None:
            scene.cycles.shading_system = True
    scene.view_settings.view_transform = "Standard"  # as the photos are shown
    made = create_scan_collection(scene, capture, scan, path.parent / "photos")
    scene.patina.capture = str(capture.file)
    scene.patina.mesh = made.mesh
    return made


def _save(path: Path) -> None:
    """Save with pictures by relative paths (the folder will be moved) and without a .blend1."""
    for image in bpy.data.images:
        if image.source == "FILE" and image.packed_file is None:
            image.filepath = bpy.path.relpath(image.filepath, start=str(path.parent))
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, compress=True)
    path.with_suffix(".blend1").unlink(missing_ok=True)
