"""Write GLB with Blender's exporter: the portable output of every material, KHR extensions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import PatinaError
from ...core.views.display import srgb
from .export_scene import select_only

ADD_ON = "io_scene_gltf2"
NO_COLOURS = "export_vertex_color"  # option of the exporter


def write_glb(path: Path, objects: Sequence[bpy.types.Object]) -> None:
    """Write the objects as one binary glTF with y up, as the format requires. Their colour
    textures become 8-bit images in sRGB.

    Raises PatinaError if Blender's exporter fails.
    """
    import addon_utils

    if not hasattr(bpy.ops.export_scene, "gltf") or ADD_ON not in bpy.context.preferences.addons:
        addon_utils.enable(ADD_ON)
    select_only(objects)
    encode_colours(objects)
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


def encode_colours(objects: Sequence[bpy.types.Object]) -> None:
    """Replace textures with linear colours by 8-bit images in sRGB. The exporter writes the values
    of floating-point images as they are, and every viewer decodes them as sRGB."""
    for material in {s.material for thing in objects for s in thing.material_slots if s.material}:
        for node in material.node_tree.nodes if material.node_tree else ():
            image = getattr(node, "image", None)
            if image is not None and image.is_float and not image.colorspace_settings.is_data:
                node.image = _encoded(image)


def _encoded(image: bpy.types.Image) -> bpy.types.Image:
    name, (width, height) = f"{image.name} sRGB", image.size
    made = bpy.data.images.get(name)
    if made is not None:
        return made
    pixels = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(-1, 4)
    pixels[:, :3] = srgb(pixels[:, :3]) / np.float32(255)
    made = bpy.data.images.new(name, width, height, alpha=False)
    made.pixels.foreach_set(pixels.ravel())
    made.pack()
    return made
