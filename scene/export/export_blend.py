"""Export the materials as a .blend: each is an asset on a preview sphere, with its shader files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...core.export.subject import Subject
from ..material import osl_files
from ..material.assets import mark
from .blend_file import save
from .export_scene import create_materials, new_scene, preview_spheres


def write_blend(
    path: Path, final: Path, subjects: Sequence[Subject], record: dict[str, Any]
) -> dict[str, list[str]]:
    """Write the .blend and, next to it, the EXRs that its shaders read.

    final: the path that the file and its companion files will be moved to. record: the content of
    the result.json of the materials, for the description of the assets. Returns the names of
    the EXRs by material.
    """
    new_scene()
    save(path, final)  # the shader's EXRs are written next to a saved file
    made = create_materials(subjects, whole=True)
    preview_spheres(made)
    shader_files: dict[str, list[str]] = {}
    for subject, material in zip(subjects, made, strict=True):
        mark(material, record)
        own = osl_files.redirect_files(material, final.parent)
        shader_files.setdefault(subject.name, []).extend(file.name for file in own)
    save(path, final)
    return shader_files
