"""Write USD with Blender's exporter: UsdPreviewSurface, and MaterialX (OpenPBR) if supported."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...core.errors import PatinaError
from .export_scene import select_only

MATERIALX = "generate_materialx_network"
OPTIONS = {
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
    """Raise PatinaError if this build of Blender has no USD (some distributions' builds)."""
    if not bpy.app.build_options.usd:
        raise PatinaError("This build of Blender has no USD; use a build from blender.org")


def write_usd(path: Path, objects: Sequence[bpy.types.Object]) -> bool:
    """Write the objects as USD; returns whether the materials are also written as MaterialX.

    Raises PatinaError if Blender's exporter fails.
    """
    select_only(objects)
    known = bpy.ops.wm.usd_export.get_rna_type().properties.keys()
    options = {key: value for key, value in OPTIONS.items() if key in known}
    try:
        bpy.ops.wm.usd_export(filepath=str(path), **options)
    except RuntimeError as error:
        message = " ".join(str(error).split())
        raise PatinaError(f"{path.name}: Blender's USD exporter failed ({message})") from error
    if not path.is_file():
        raise PatinaError(f"{path.name}: Blender's USD exporter wrote nothing")
    return bool(options.get(MATERIALX))
