"""The result of a fit as its materials are now: renamed, or with changed traits."""

from __future__ import annotations

import re
from collections.abc import Generator
from typing import Any

import bpy
import numpy as np

from ...core.concurrency.job import Step
from ...core.errors import PatinaError
from ...core.result.reader import FORBIDDEN
from ...core.views.prepared_materials import PRINCIPLED, EditedMaterialJob
from ..material.measured_materials import measured_of
from ..material.trait_offsets import edited_brdf, movable, state
from ..property_keys import MEASURED_DATE, MEASURED_NAME
from ..session.child_processes import in_child

NUMBERED = re.compile(r"\.\d{3,}")  # suffix by which Blender keeps names apart


def export_name(material: bpy.types.Material) -> str:
    """The name of a measured material in exported files: its name in Blender if the user renamed
    it, else that in the capture. Characters that no file name can hold become "_"."""
    own = str(material[MEASURED_NAME])
    name = material.name
    if name.startswith(own) and (name == own or NUMBERED.fullmatch(name[len(own) :])):
        return own
    return "".join("_" if c in FORBIDDEN or not c.isprintable() else c for c in name)


def present_result(found: dict[str, Any], capture: str) -> Generator[Step, None, dict[str, Any]]:
    """The content of result.json with the present name, coefficients and Principled BSDF of each
    material. A changed material has the entry ``changed``.

    found: the content as measured; it is not modified. Raises PatinaError if the basis of a changed
    material is not on this computer.
    """
    materials, entries = measured_of(capture), []
    for entry in found["materials"]:
        material = materials.get(entry["name"])
        if material is None:
            entries.append(entry)
            continue
        now = {**entry, "name": export_name(material), "date": material.get(MEASURED_DATE, "")}
        if movable(material) and state(material):
            now.update((yield from _changed(material, now["name"])))
        entries.append(now)
    names = {a["name"]: b["name"] for a, b in zip(found["materials"], entries, strict=True)}
    varying = found.get("varying")
    if varying:
        listed = [{**one, "name": names[one["name"]]} for one in varying["materials"]]
        varying = {**varying, "materials": listed}
    return {**found, "materials": entries, "varying": varying}


def _changed(material: bpy.types.Material, name: str) -> Generator[Step, None, dict[str, Any]]:
    """The entries of a material whose traits were changed."""
    brdf = edited_brdf(material)
    if brdf is None:
        raise PatinaError(
            f"The basis of {name} is not on this computer, so its changed traits cannot be "
            "exported; fit the material again, or reset its traits"
        )
    job = yield from in_child(EditedMaterialJob(brdf, [PRINCIPLED]))
    fit = job.found[PRINCIPLED]
    if fit is None:
        raise PatinaError(
            f"The changed traits of {name} have no Principled BSDF; reset its traits, or change "
            "them less"
        )
    return {
        "coefficients": np.asarray(brdf.coefficients, float).tolist(),
        "principled": {
            **{key: np.asarray(value).tolist() for key, value in vars(fit.principled).items()},
            "cube_root_error": fit.error,
            "lambertian_cube_root_error": fit.diffuse_error,
        },
        "changed": True,
    }
