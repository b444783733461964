"""USD through Blender's own exporter: UsdPreviewSurface, and MaterialX (OpenPBR) where it can."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...core.errors import PatinaError
from .export_scene import select_only

MATERIALX = "generate_materialx_network"
WANTED = {
    "selected_objects_only": True,
    "export_materials": True,
    "generate_preview_surface": True,
    MATERIALX: True,
    "convert_world_material": False,
    "export_animation": False,
    "export_hair": False,
    "export_lights": False,
    "export_cameras": False,
    "export_custom_properties": False,
    "export_textures_mode": "NEW",
    "root_prim_path": "/root",
    "relative_paths": True,
}


def check_usd() -> None:
    """Raises PatinaError where this Blender writes no USD (some distributions' builds)."""
    if not bpy.app.build_options.usd:
        raise PatinaError("this Blender was built without USD; use one from blender.org")


def write_usd(path: Path, objects: Sequence[bpy.types.Object]) -> bool:
    """Write the objects as USD; True where the materials are there as MaterialX too."""
    select_only(objects)
    known = bpy.ops.wm.usd_export.get_rna_type().properties.keys()
    told = {key: value for key, value in WANTED.items() if key in known}
    try:
        bpy.ops.wm.usd_export(filepath=str(path), **told)
    except RuntimeError as error:
        said = " ".join(str(error).split())
        raise PatinaError(f"{path.name}: Blender's USD exporter failed ({said})") from error
    if not path.is_file():
        raise PatinaError(f"{path.name}: Blender's USD exporter wrote nothing")
    return bool(told.get(MATERIALX))
