"""Write a .blend whose measured materials have maps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...core.jobs import Stage
from ...core.maps.maps_result import MapsResult
from ...core.maps.write import MapFile
from ..material import osl_files
from ..material.measured_materials import measured_materials
from ..material.packed_exr import write_packed
from ..scan.apply_maps import apply_maps
from .blend_file import save, write_blend
from .open_blend import open_blend


def write_mapped_blend(
    path: Path,
    final: Path,
    result: MapsResult,
    files: Sequence[MapFile],
    source: Path | None,
    stages: Sequence[Stage],
) -> list[str]:
    """Save a scene with the maps on its materials as ``path``; returns notes for the user.

    The maps are in the same folder and move with the file to ``final``. The scene is that of the
    refit without painted texture, if there was one, else ``source``, the .blend of the fit. If
    ``source`` is None as well, nothing is written.
    """
    notes: list[str] = []
    if result.refit is not None:
        notes += write_blend(path, final, result.refit, stages)
    elif source is not None:
        _open(source)
        _own_shader_files(path, final)
    else:
        return ["The result has no scene.blend, so the maps were not assigned to materials."]
    notes += apply_maps(bpy.context.scene, result, path.parent, files)
    save(path, final)
    return notes


def _open(source: Path) -> None:
    """Open a .blend and make its image paths absolute, so that it can be saved elsewhere."""
    open_blend(source.resolve())
    for image in bpy.data.images:
        own_file = image.source == "FILE" and image.packed_file is None
        if own_file and image.filepath.startswith("//"):
            image.filepath = bpy.path.abspath(image.filepath)


def _own_shader_files(path: Path, final: Path) -> None:
    """Write the shader's packed EXRs next to the new file, and point its nodes to them."""

    def moved(file: Path) -> bool:
        image = bpy.data.images.get(file.name)
        return write_packed(image, path.parent / file.name)

    for material in measured_materials():
        osl_files.redirect_files(material, final.parent, moved)
