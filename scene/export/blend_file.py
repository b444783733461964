"""Write a capture or a whole result as a .blend file (headless)."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

import bpy

from ...core.capture import Capture
from ...core.errors import PatinaError
from ...core.inputs.lights import Lights
from ...core.jobs import CaptureResult, Stage
from ...core.report.diagnosis_json import CheckRecord
from ...core.scan import Reconstruction, Scan
from ..material import material_nodes, osl_files
from ..material.measured_materials import measured_materials
from ..scan.apply_result import apply_result
from ..scan.evidence_colours import paint_evidence
from ..scan.orientation import set_upright
from ..scan.scan_collection import ScanCollection, create_reconstruction, create_scan_collection
from ..session.scene_properties import DIAGNOSIS, store_result

RECTIFIED = "rectified"  # folder next to the .blend for resampled photos of distorted lenses


def write_import(path: Path, final: Path, capture: Capture, scan: Scan, lights: Lights) -> None:
    """Write a .blend with mesh, cameras with photos, and lights.

    final: the path that the file and its companion files will be moved to.
    """
    _imported(path, capture, scan, lights)
    save(path, final)


def write_reconstruction(
    path: Path,
    final: Path,
    found: Reconstruction,
    images: Path | None,
) -> None:
    """Write a .blend with the cameras and sparse points of a reconstruction without a mesh."""
    scene = _new_file()
    create_reconstruction(scene, final.stem, found, images, path.parent / RECTIFIED)
    set_upright(scene)
    save(path, final)


def write_blend(
    path: Path,
    final: Path,
    result: CaptureResult,
    stages: Sequence[Stage],
    check: CheckRecord | None = None,
) -> list[str]:
    """Write a .blend of a capture with the fitted materials on its mesh; returns notes for the
    user. check: a diagnosis, which the Check panel then shows."""
    _imported(path, result.capture, result.scan, result.lights)
    save(path, final)  # the shader's EXRs are written next to a saved file
    notes = apply_result(bpy.context.scene, result, stages)
    for material in measured_materials():
        osl_files.redirect_files(material, final.parent)
    if check is not None:
        store_result(str(result.capture.file), check.description, DIAGNOSIS)
        vertices, pixels = check.context.rays.mesh.vertices, check.context.pixels
        paint_evidence(bpy.context.scene.patina.mesh, vertices, pixels, check.found)
    save(path, final)
    return notes


def _imported(path: Path, capture: Capture, scan: Scan, lights: Lights) -> ScanCollection:
    scene = _new_file()
    made = create_scan_collection(scene, capture, scan, lights, path.parent / RECTIFIED)
    scene.patina.capture = str(capture.file)
    scene.patina.mesh = made.mesh
    set_upright(scene)
    return made


def _new_file() -> bpy.types.Scene:
    """An empty file with a black world, Cycles, and the view transform of the photos."""
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
        if material_nodes.osl_missing() is None:
            scene.cycles.shading_system = True
    scene.view_settings.view_transform = "Standard"  # as the photos are shown
    return scene


def save(path: Path, final: Path) -> None:
    """Save the open file with image paths relative to ``final`` and without a .blend1.

    Raises PatinaError if Blender cannot write the file.
    """
    here, there = path.absolute().parent, final.absolute().parent
    for image in bpy.data.images:
        if image.source != "FILE" or image.filepath.startswith("//"):
            continue  # has no file, or was made relative at an earlier save
        picture = Path(image.filepath)
        if picture.is_relative_to(here):
            picture = there / picture.relative_to(here)
        image.filepath = str(picture)
        with contextlib.suppress(ValueError):  # on another drive: stays absolute
            image.filepath = bpy.path.relpath(str(picture), start=str(there))
    try:
        bpy.ops.wm.save_as_mainfile(
            filepath=str(path), check_existing=False, compress=True, relative_remap=False
        )
    except RuntimeError as error:
        raise PatinaError(f"{final}: cannot be written ({error})") from error
    path.with_suffix(".blend1").unlink(missing_ok=True)
