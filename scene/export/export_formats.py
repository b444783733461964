"""The exports that Blender writes: .blend, GLB and USD, each with what it could not take along."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import bpy

from ...core.export import Loss, gltf_model, preview_surface
from ...core.export.dropped import dropped_inputs
from ...core.export.subject import Subject
from ...core.result import FittedResult
from ..material.material_nodes import osl_missing
from . import export_scene
from .export_blend import write_blend
from .export_gltf import write_glb
from .export_usd import check_usd, write_usd

OPEN_PBR_SINCE = (5, 0, 0)
SCAN, PREVIEW = "scan", "materials"  # stems of files
FIT = "what the fit has beyond one Principled BSDF"


def to_blend(
    folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """materials.blend: measured in Cycles with OSL, the Principled elsewhere."""
    file = f"{PREVIEW}.blend"
    files = write_blend(folder / file, final / file, subjects)
    reason = osl_missing()
    losses = []
    for subject in subjects:
        errors = {
            "EEVEE, and Cycles without OSL (lobe stack)": subject.error(
                subject.lobes.stack.evaluate
            ),
            "exporters (Principled)": subject.error(subject.material.principled.evaluate),
        }
        losses.append(
            Loss(
                "blend",
                subject.name,
                (file, *sorted(files[subject.name])),
                errors if reason else {"Cycles with OSL": 0.0, **errors},
                dropped=(f"the measured material: {reason}",) if reason else (),
                notes=subject.scale_note,
            )
        )
    return losses


def to_gltf(
    folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """scan.glb with the scan's mesh, else materials.glb with a preview sphere each."""
    objects, stem = _objects(result, subjects)
    write_glb(folder / f"{stem}.glb", objects)
    losses = []
    for subject in subjects:
        principled = subject.material.principled
        held = partial(gltf_model.evaluate, principled)
        losses.append(
            Loss(
                "gltf",
                subject.name,
                (f"{stem}.glb",),
                {
                    "metallic-roughness with KHR extensions": subject.error(held),
                    "the Principled BSDF it was made of": subject.error(principled.evaluate),
                },
                dropped=(*dropped_inputs(principled, gltf_model.DROPPED), FIT),
                notes=subject.scale_note,
            )
        )
    return losses


def to_usd(
    folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """scan.usdc with the scan's mesh, else materials.usdc with a preview sphere each."""
    check_usd()
    objects, stem = _objects(result, subjects)
    with_materialx = write_usd(folder / f"{stem}.usdc", objects)
    losses = []
    for subject in subjects:
        principled = subject.material.principled
        preview = subject.error(partial(preview_surface.evaluate, principled))
        whole = subject.error(principled.evaluate)
        lost = dropped_inputs(principled, preview_surface.DROPPED)
        errors = {"UsdPreviewSurface": preview}
        if with_materialx:
            surface = "OpenPBR" if bpy.app.version >= OPEN_PBR_SINCE else "its surface"
            errors = {f"MaterialX ({surface}, taken for the Principled)": whole, **errors}
        notes = () if with_materialx else ("this Blender writes no MaterialX into USD",)
        losses.append(
            Loss(
                "usd",
                subject.name,
                (f"{stem}.usdc",),
                errors,
                dropped=(*(f"in UsdPreviewSurface: {what}" for what in lost), FIT),
                notes=(*notes, *subject.scale_note),
            )
        )
    return losses


def _objects(result: FittedResult, subjects: Sequence[Subject]) -> tuple[list, str]:
    """The scan's mesh where there is one that wears all of the result's materials, and no part
    of them alone is asked for; else preview spheres. With the stem of the file."""
    names = [material.name for material in result.materials]
    if result.scene is not None and len(subjects) == len(names):
        mesh = export_scene.open_scan(result.scene, names)
        if mesh is not None:
            return [mesh], SCAN
    export_scene.new_stage()
    made = export_scene.create_materials(subjects, whole=False)
    return export_scene.preview_spheres(made), PREVIEW


def write_format(
    name: str, folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """Write one of the formats that need Blender into ``folder``, whose files will move to
    ``final``."""
    write = {"blend": to_blend, "gltf": to_gltf, "usd": to_usd}[name]
    return write(folder, final, result, subjects)
