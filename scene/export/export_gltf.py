"""Write GLB with Blender's exporter: the portable output of every material, KHR extensions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...core.errors import PatinaError
from .export_scene import select_only

ADD_ON = "io_scene_gltf2"
NO_COLOURS = "export_vertex_color"  # option of the exporter


def write_glb(path: Path, objects: Sequence[bpy.types.Object]) -> None:
    """Write the objects as one binary glTF with y up, as the format requires.

    Raises PatinaError if Blender's exporter fails.
    """
    import addon_utils

    if not hasattr(bpy.ops.export_scene, "gltf") or ADD_ON not in bpy.context.preferences.addons:
        addon_utils.enable(ADD_ON)
    select_only(objects)
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    try:
        bpy.ops.export_scene.gltf(
            filepath=str(path),
            export_format="GLB",
            use_selection=True,
            export_yup=True,
            export_apply=False,
            export_cameras=False,
            export_lights=False,
            export_animations=False,
            export_extras=False,
            export_image_format="AUTO",
            # a viewer multiplies the base colour by COLOR_0, which would change the material
            **{NO_COLOURS: "NONE"} if NO_COLOURS in known else {},
        )
    except (RuntimeError, AttributeError) as error:
        message = " ".join(str(error).split())
        raise PatinaError(f"{path.name}: Blender's glTF exporter failed ({message})") from error
    if not path.is_file():
        raise PatinaError(f"{path.name}: Blender's glTF exporter wrote nothing")
