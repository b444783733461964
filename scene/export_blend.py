"""A .blend of the materials: an asset each, on a preview sphere, with the files of its shader."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..core.export.subject import Subject
from . import osl_files
from .blend_file import _save
from .export_stage import create_materials, new_stage, preview_spheres


def write_blend(path: Path, final: Path, subjects: Sequence[Subject]) -> dict[str, list[str]]:
    """Write the .blend and, beside it, the EXRs its shaders read; returns the names of the EXRs
    by material.

    final: where the file will be moved to, with all that lies beside it.
    """
    new_stage()
    _save(path, final)  # the shader's EXRs go beside a saved file
    made = create_materials(subjects, whole=True)
    preview_spheres(made)
    beside: dict[str, list[str]] = {}
    for subject, material in zip(subjects, made, strict=True):
        own = beside.setdefault(subject.name, [])
        material.asset_mark()
        for node in osl_files.script_nodes(material):
            for socket in osl_files.file_sockets(node):
                file = Path(socket.default_value)
                own.append(file.name)
                socket.default_value = (final.absolute().parent / file.name).as_posix()
    _save(path, final)
    return beside
