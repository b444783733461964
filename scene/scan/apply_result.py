"""Apply the result of a fit to the open .blend: create and assign the materials, store the
description."""

from __future__ import annotations

import re
from collections.abc import Generator, Mapping, Sequence
from datetime import date

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.concurrency.steps import drained
from ...core.jobs import CaptureResult, Stage
from ...core.report.result_json import describe
from ...core.views.prepared_materials import Prepared, prepare
from ..material import material_nodes, osl_files
from ..material.lobe_group import stack_group
from ..material.material_evidence import keep_earlier, keep_evidence
from ..material.measured_materials import measured_materials
from ..material.preview import set_preview
from ..photos.proposed_photo import remove_proposed_lamp
from ..property_keys import CAPTURE, MEASURED_DATE, MEASURED_NAME, NO_OSL_REASON
from ..session.scene_properties import store_result
from . import meshes
from .apply_maps import remove_unused_maps
from .apply_variation import apply_variation_steps
from .face_slots import remove_placeholders
from .variation_colours import paint_variation_steps

NUMBER_SUFFIX = re.compile(r"\.\d{3}$")  # Blender appends it to make names unique


def apply_result(
    scene: bpy.types.Scene,
    result: CaptureResult,
    stages: Sequence[Stage],
    prepared: Sequence[Prepared] = (),
) -> list[str]:
    """Create the materials, assign them to the scanned mesh, and store the description.

    Materials of an earlier fit are replaced. prepared: data of each material, if it is computed
    already. Returns notes for the user.
    """
    return drained(apply_result_steps(scene, result, stages, prepared))


def apply_result_steps(
    scene: bpy.types.Scene,
    result: CaptureResult,
    stages: Sequence[Stage],
    prepared: Sequence[Prepared] = (),
    colours: Mapping[str, NDArray[np.float32]] | None = None,
) -> Generator[None, None, list[str]]:
    """``apply_result`` as a generator, one piece per step. colours: at_vertices(result.varying), if
    it is computed already."""
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
            files = yield from osl_files.ensure_files_steps(brdf, own.tables)
        stack_group()  # created once per .blend, in a tenth of a second
        yield
        new = material_nodes.create_material(
            fitted.name, brdf, fitted.principled, files, fitted.lobes
        )
        new[MEASURED_NAME], new[CAPTURE] = fitted.name, capture
        yield
        new[MEASURED_DATE] = date.today().isoformat()
        set_preview(new, own.spheres)
        keep_evidence(new, fitted)
        if old is not None:
            keep_earlier(new, old)
            name = old.name
            old.user_remap(new)
            bpy.data.materials.remove(old)
            new.name = name
        if NO_OSL_REASON in new:
            notes.append(
                f"{fitted.name}: renders show the portable material instead of the measured BRDF, "
                f"because {new[NO_OSL_REASON]}."
            )
        made.append(new)
        yield
    osl_files.drop_unused()
    mesh = scene.patina.mesh
    if mesh is None or mesh.type != "MESH" or mesh.name not in scene.objects:
        notes.append(
            "The scanned mesh is not in this scene; the materials were created but not assigned."
        )
    elif not meshes.assign_materials(mesh, made, result.face_material):
        notes.append(
            f"{mesh.name} no longer has the faces of the scan; all faces got the first material."
        )
    yield
    remove_unused_maps()
    notes += yield from apply_variation_steps(scene, result)
    yield from paint_variation_steps(mesh, result.varying, colours)
    remove_placeholders(capture)
    remove_proposed_lamp(scene, capture)
    for material in made:  # the name is free now; other names were set by the user
        name = material[MEASURED_NAME]
        if NUMBER_SUFFIX.sub("", material.name) == name and name not in bpy.data.materials:
            material.name = name
    store_result(capture, describe(result, stages, notes))
    return notes


def _is(material: bpy.types.Material, name: str, capture: str) -> bool:
    return material[MEASURED_NAME] == name and material.get(CAPTURE) == capture
