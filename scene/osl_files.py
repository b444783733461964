"""The EXR of the components: where it lies, and how it comes back when the .blend has moved.

OSL reads pictures by their path, so the file must exist on disk: beside a saved .blend, else in the
extension's own folder. A packed copy travels inside the .blend (an Image data-block that a fake
user keeps) and is written out again on load where the path no longer leads to it.
"""

from __future__ import annotations

import logging
import os
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from ..core.appearance import osl_atlas
from ..core.basis import Basis
from .folders import blend_folder

log = logging.getLogger(__name__)

SOCKET = "components"
FILE_PROPERTY = "patina_components"  # on the material: the atlas' file name


def ensure_components(basis: Basis) -> Path:
    """The atlas of a basis: on disk where this .blend expects it, and packed into the .blend."""
    name = osl_atlas.file_name(basis)
    path = blend_folder() / name
    if not path.is_file():
        packed = bpy.data.images.get(name)
        if packed is None or not _write_packed(packed, path):
            osl_atlas.write(path, basis)
    pack(path)
    return path


def pack(path: Path) -> bpy.types.Image:
    """The file's bytes as a packed Image of its name; packed once."""
    image = bpy.data.images.get(path.name)
    if image is None:
        image = bpy.data.images.load(str(path))
        image.name = path.name
        image.colorspace_settings.name = "Non-Color"
    if image.packed_file is None:
        with open(path, "rb") as file:
            data = file.read()
        image.pack(data=data, data_len=len(data))
    image.use_fake_user = True
    return image


def restore() -> list[str]:
    """Point every Patina material at its atlas, writing packed ones out where they are missing.

    Returns the names of materials whose atlas is neither on disk nor in the .blend.
    """
    missing = []
    for material in bpy.data.materials:
        name = material.get(FILE_PROPERTY)
        if not name or material.library is not None:
            continue
        for node in script_nodes(material):
            if os.path.isfile(node.inputs[SOCKET].default_value):
                continue
            path = blend_folder() / name
            image = bpy.data.images.get(name)
            if path.is_file() or (image is not None and _write_packed(image, path)):
                node.inputs[SOCKET].default_value = path.as_posix()
            else:
                missing.append(material.name)
    for name in missing:
        log.warning("%s: the EXR of its components is gone; make the material again", name)
    return missing


def script_nodes(material: bpy.types.Material) -> list[bpy.types.Node]:
    """The material's Patina shaders."""
    if material.node_tree is None:
        return []
    return [
        node
        for node in material.node_tree.nodes
        if node.bl_idname == "ShaderNodeScript" and SOCKET in node.inputs
    ]


def _write_packed(image: bpy.types.Image, path: Path) -> bool:
    """Write the packed bytes to a file, whole or not at all."""
    if image.packed_file is None:
        return False
    partial = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(image.packed_file.data)
        os.replace(partial, path)
    except OSError as error:
        log.warning("%s: cannot be written (%s)", path, error.strerror)
        return False
    return True


@persistent
def _after_load(*_: object) -> None:
    restore()


@persistent
def _after_save(*_: object) -> None:
    """A first save gives the .blend a folder: the atlas follows it there."""
    for material in bpy.data.materials:
        name = material.get(FILE_PROPERTY)
        image = bpy.data.images.get(name) if name else None
        if image is not None and not (blend_folder() / name).is_file():
            _write_packed(image, blend_folder() / name)


def register() -> None:
    """Watch for loading and saving."""
    bpy.app.handlers.load_post.append(_after_load)
    bpy.app.handlers.save_post.append(_after_save)


def unregister() -> None:
    """Leave nothing behind."""
    bpy.app.handlers.save_post.remove(_after_save)
    bpy.app.handlers.load_post.remove(_after_load)
