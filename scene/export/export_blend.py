"""A .blend of the materials: an asset each, on a preview sphere, with the files of its shader."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...core.export.subject import Subject
from ..material import osl_files
from .blend_file import save
from .export_scene import create_materials, new_stage, preview_spheres


def write_blend(path: Path, final: Path, subjects: Sequence[Subject]) -> dict[str, list[str]]:
    """Write the .blend and, beside it, the EXRs its shaders read; returns the names of the EXRs
    by material.

    final: where the file will be moved to, with all that lies beside it.
    """
    new_stage()
    save(path, final)  # the shader's EXRs go beside a saved file
    made = create_materials(subjects, whole=True)
    preview_spheres(made)
    beside: dict[str, list[str]] = {}
    for subject, material in zip(subjects, made, strict=True):
        material.asset_mark()
        own = osl_files.lead_to(material, final.parent)
        beside.setdefault(subject.name, []).extend(file.name for file in own)
    save(path, final)
    return beside
