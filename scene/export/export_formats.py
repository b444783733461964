"""The exports that Blender writes (.blend, GLB and USD), each with a record of what it loses."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import bpy

from ...core.appearance.open_pbr.fit import from_principled
from ...core.export import Loss, gltf_model, preview_surface
from ...core.export.dropped import dropped_inputs
from ...core.export.subject import Subject
from ...core.result import FittedResult
from ..material.map_nodes import principled_nodes
from ..material.material_nodes import fill_principled, osl_missing
from . import export_scene
from .export_blend import write_blend
from .export_gltf import write_glb
from .export_scene import as_fitted, materials_by_name
from .export_usd import check_usd, write_usd
from .usd_surfaces import Replaced, UsdSurfaces, can_replace, replace_surfaces

SCAN, PREVIEW = "scan", "materials"  # stems of the file names
BEYOND_PRINCIPLED = "everything of the fitted BRDF that one Principled BSDF cannot represent"
OPEN_PBR_SINCE = (5, 0, 0)
KEPT = (
    "the material has maps or was changed in the scene, so the file has its own values; the errors "
    "are those of the fitted values"
)
TRANSLATED = "the file has the values that Blender translates from its Principled BSDF"


def to_blend(
    folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """Write materials.blend: the measured BRDF in Cycles with OSL, the Principled elsewhere."""
    file = f"{PREVIEW}.blend"
    record = json.loads(result.file.read_text("utf-8"))
    files = write_blend(folder / file, final / file, subjects, record)
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
                dropped=(f"the measured BRDF, because {reason}",) if reason else (),
                notes=subject.scale_note,
            )
        )
    return losses


def to_gltf(
    folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """Write scan.glb with the scan's mesh, or materials.glb with a preview sphere per material."""
    objects, stem = _objects(result, subjects)
    fitted = fitted_materials(objects, subjects)
    for subject in subjects:
        for material in fitted.get(subject.name, ()):
            for node in principled_nodes(material):
                fill_principled(node, subject.gltf.principled)
    write_glb(folder / f"{stem}.glb", objects)
    losses = []
    for subject in subjects:
        own = subject.material.principled
        principled = subject.gltf.principled if subject.name in fitted else own
        losses.append(
            Loss(
                "gltf",
                subject.name,
                (f"{stem}.glb",),
                {
                    "metallic-roughness with KHR extensions": subject.error(
                        partial(gltf_model.evaluate, principled)
                    ),
                    "the Principled BSDF in Blender": subject.error(own.evaluate),
                },
                dropped=(*dropped_inputs(principled, gltf_model.DROPPED), BEYOND_PRINCIPLED),
                notes=(*(() if subject.name in fitted else (KEPT,)), *subject.scale_note),
            )
        )
    return losses


def to_usd(
    folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """Write scan.usdc with the scan's mesh, or materials.usdc with a preview sphere per
    material."""
    check_usd()
    objects, stem = _objects(result, subjects)
    file = folder / f"{stem}.usdc"
    with_materialx = write_usd(file, objects)
    fitted = fitted_materials(objects, subjects)
    has_open_pbr = with_materialx and bpy.app.version >= OPEN_PBR_SINCE
    replaced = Replaced(frozenset(), frozenset())
    if can_replace():
        exported = {s.material.name for o in objects for s in o.material_slots if s.material}
        surfaces = {
            material.name: UsdSurfaces(
                s.preview_surface.principled, s.open_pbr.surface if has_open_pbr else None
            )
            for s in subjects
            for material in fitted.get(s.name, ())
        }
        replaced = replace_surfaces(file, surfaces, exported)
    losses = []
    for subject in subjects:
        names = {material.name for material in fitted.get(subject.name, ())}
        own = subject.material.principled
        new_preview = bool(names) and names <= replaced.preview
        shown = subject.preview_surface.principled if new_preview else own
        errors = {}
        if names and names <= replaced.open_pbr:
            errors["MaterialX (OpenPBR)"] = subject.error(subject.open_pbr.surface.evaluate)
        elif has_open_pbr:
            errors["MaterialX (OpenPBR, values of the Principled)"] = subject.error(
                from_principled(own).evaluate
            )
        elif with_materialx:
            errors["MaterialX (its surface, taken for the Principled)"] = subject.error(
                own.evaluate
            )
        errors["UsdPreviewSurface"] = subject.error(partial(preview_surface.evaluate, shown))
        lost = dropped_inputs(shown, preview_surface.DROPPED)
        notes = () if with_materialx else ("this version of Blender writes no MaterialX into USD",)
        if not new_preview:
            notes = (*notes, KEPT if not names else TRANSLATED)
        losses.append(
            Loss(
                "usd",
                subject.name,
                (f"{stem}.usdc",),
                errors,
                dropped=(*(f"in UsdPreviewSurface: {what}" for what in lost), BEYOND_PRINCIPLED),
                notes=(*notes, *subject.scale_note),
            )
        )
    return losses


def fitted_materials(
    objects: Sequence[bpy.types.Object], subjects: Sequence[Subject]
) -> dict[str, list[bpy.types.Material]]:
    """The materials of the objects that still have the fitted values, with their copies, by
    name."""
    found = materials_by_name(objects, [subject.name for subject in subjects])
    fitted = {subject.name: subject.material.principled for subject in subjects}
    return {
        name: materials
        for name, materials in found.items()
        if all(as_fitted(material, fitted[name]) for material in materials)
    }


def _objects(result: FittedResult, subjects: Sequence[Subject]) -> tuple[list, str]:
    """(objects to export, stem of the file name): the scan's mesh, or preview spheres.

    The mesh is exported if all materials of the result are requested and it has all of them.
    """
    names = [material.name for material in result.materials]
    if result.scene is not None and len(subjects) == len(names):
        mesh = export_scene.open_scan(result.scene, names)
        if mesh is not None:
            return [mesh], SCAN
    export_scene.new_scene()
    made = export_scene.create_materials(subjects, whole=False)
    return export_scene.preview_spheres(made), PREVIEW


def write_format(
    name: str, folder: Path, final: Path, result: FittedResult, subjects: Sequence[Subject]
) -> list[Loss]:
    """Write one of the formats that need Blender into ``folder``, whose files will move to
    ``final``."""
    write = {"blend": to_blend, "gltf": to_gltf, "usd": to_usd}[name]
    return write(folder, final, result, subjects)
