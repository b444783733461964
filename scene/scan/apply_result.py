"""A fit's result into the open .blend: materials on the mesh, the description kept."""

from __future__ import annotations

import re
from collections.abc import Generator, Sequence
from datetime import date

import bpy

from ...core.concurrency.steps import drained
from ...core.jobs import CaptureResult, Stage
from ...core.report.result_json import describe
from ..material import material_nodes, osl_files
from ..material.lobe_group import stack_group
from ..material.material_evidence import keep_earlier, keep_evidence
from ..material.measured_materials import measured_materials
from ..material.prepared_materials import Prepared, prepare
from ..material.preview import put_spheres
from ..property_keys import CAPTURE, MEASURED_DATE, MEASURED_NAME, NO_OSL_REASON
from ..session.scene_properties import store_result
from . import meshes
from .face_slots import drop_stand_ins

NUMBERED = re.compile(r"\.\d{3}$")  # as Blender keeps names apart


def apply_result(
    scene: bpy.types.Scene,
    result: CaptureResult,
    stages: Sequence[Stage],
    prepared: Sequence[Prepared] = (),
) -> list[str]:
    """Make the materials, put them on the scanned mesh where it is in the scene, and keep the
    description. Returns notes for the user. A material of an earlier fit is replaced. prepared: of
    each material, where it was made before."""
    return drained(applying(scene, result, stages, prepared))


def applying(
    scene: bpy.types.Scene,
    result: CaptureResult,
    stages: Sequence[Stage],
    prepared: Sequence[Prepared] = (),
) -> Generator[None, None, list[str]]:
    """``apply_result``, a piece at a time."""
    with_osl = material_nodes.osl_missing() is None
    capture = str(result.capture.file)
    notes: list[str] = []
    made = []
    for place, fitted in enumerate(result.materials):
        old = next((m for m in measured_materials() if _is(m, fitted.name, capture)), None)
        brdf = fitted.fit.brdf
        own = prepared[place] if prepared else prepare(brdf, with_osl)
        yield
        files = None
        if with_osl:
            files = yield from osl_files.ensuring_files(brdf, own.tables)
        stack_group()  # once a file, a tenth of a second
        yield
        new = material_nodes.create_material(
            fitted.name, brdf, fitted.principled, files, fitted.lobes
        )
        new[MEASURED_NAME], new[CAPTURE] = fitted.name, capture
        yield
        new[MEASURED_DATE] = date.today().isoformat()
        put_spheres(new, own.spheres)
        keep_evidence(new, fitted)
        if old is not None:
            keep_earlier(new, old)
            name = old.name
            old.user_remap(new)
            bpy.data.materials.remove(old)
            new.name = name
        if NO_OSL_REASON in new:
            notes.append(
                f"{fitted.name}: only the Principled fit is wired, because {new[NO_OSL_REASON]}"
            )
        made.append(new)
        yield
    osl_files.drop_unused()
    mesh = scene.patina.mesh
    if mesh is None or mesh.type != "MESH" or mesh.name not in scene.objects:
        notes.append("the scanned mesh is not in this scene: materials were made, not assigned")
    elif not meshes.assign_materials(mesh, made, result.face_material):
        notes.append(f"{mesh.name} no longer has the scan's faces: all wear the first material")
    yield
    drop_stand_ins(capture)
    for material in made:  # what had its name made way; another name is the artist's
        name = material[MEASURED_NAME]
        if NUMBERED.sub("", material.name) == name and name not in bpy.data.materials:
            material.name = name
    store_result(capture, describe(result, stages, notes))
    return notes


def _is(material: bpy.types.Material, name: str, capture: str) -> bool:
    return material[MEASURED_NAME] == name and material.get(CAPTURE) == capture
