"""The shader's EXRs: where they are stored, and how they are restored after the .blend has moved.

OSL reads textures by path, so the files must exist on disk: next to a saved .blend, else in the
extension's own folder. Packed copies are stored in the .blend (Image data-blocks with a fake user)
and are written again on load if the path no longer leads to a file.

A .blend may come from an untrusted source: its file names and packed bytes are checked before
anything is written.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from ...core.appearance import osl_atlas
from ...core.appearance.osl_source import COMPONENTS, REMAINDER, SAMPLING
from ...core.appearance.shader_tables import ShaderTables
from ...core.basis import PrincipalBRDF
from ...core.concurrency.steps import drained
from ..property_keys import COMPONENTS_FILE, MEASURED_SAMPLING_FILE, REMAINDER_FILE, SAMPLING_FILE
from ..session.folders import blend_folder
from ..session.handlers import attach, detach
from .packed_exr import is_regular_file, write_packed

log = logging.getLogger(__name__)

SOCKET = COMPONENTS
PROPERTIES = {
    COMPONENTS: COMPONENTS_FILE,
    REMAINDER: REMAINDER_FILE,
    SAMPLING: SAMPLING_FILE,
}
"""Socket → custom property of the material with its file name."""
OWN_PREFIXES = (osl_atlas.REMAINDER_PREFIX, osl_atlas.SAMPLING_PREFIX)


@dataclass(frozen=True)
class ShaderFiles:
    """Files of one shader. paths: socket → EXR; alphas: widths of the GGX lobes that Cycles
    samples."""

    paths: dict[str, Path]
    alphas: tuple[float, float, float]


def ensure_files(brdf: PrincipalBRDF, tables: ShaderTables | None = None) -> ShaderFiles:
    """Write a BRDF's EXRs where this .blend expects them, and pack them into it.

    tables: the BRDF's tables, if they are computed already.
    """
    return drained(ensure_files_steps(brdf, tables))


def ensure_files_steps(
    brdf: PrincipalBRDF, tables: ShaderTables | None = None
) -> Generator[None, None, ShaderFiles]:
    """``ensure_files`` as a generator, one file per step."""
    made = tables or ShaderTables.of(brdf)
    basis = brdf.basis
    wanted = (
        (COMPONENTS, osl_atlas.components_name(basis),
         lambda path: osl_atlas.write_components(path, basis)),
        (REMAINDER, osl_atlas.remainder_name(brdf),
         lambda path: osl_atlas.write_remainder(path, brdf)),
        (SAMPLING, osl_atlas.sampling_name(brdf),
         lambda path: osl_atlas.write_picture(path, made.texels)),
    )  # fmt: skip
    paths = {}
    for socket, name, write in wanted:
        paths[socket] = _ensure(name, write)
        yield
    first, second, third = (float(a) for a in made.parts.alpha)
    return ShaderFiles(paths, (first, second, third))


def _ensure(name: str, write: Callable[[Path], object]) -> Path:
    path = blend_folder() / name
    if not is_regular_file(path) and not write_packed(bpy.data.images.get(name), path):
        write(path)
    pack(path)
    return path


def file_sockets(node: bpy.types.Node) -> list[bpy.types.NodeSocket]:
    """The inputs of a Patina shader that hold a file path."""
    return [socket for socket in node.inputs if socket.identifier in PROPERTIES]


def drop_unused() -> None:
    """Remove packed files that no material uses; files on disk are kept."""
    named = [m.get(key) for m in bpy.data.materials for key in _file_properties()]
    needed = {name for name in named if osl_atlas.is_own_name(name)}
    for image in [i for i in bpy.data.images if i.name.startswith(OWN_PREFIXES)]:
        if image.name not in needed and image.users <= int(image.use_fake_user):
            bpy.data.images.remove(image)


def _file_properties() -> tuple[str, ...]:
    """The custom properties of a material that hold file names."""
    return *PROPERTIES.values(), MEASURED_SAMPLING_FILE


def pack(path: Path) -> bpy.types.Image:
    """Pack a file into the .blend as an Image of the same name, unless it is packed already."""
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
    """Point every Patina material to its files, and write missing ones from their packed copies.

    Returns the names of materials with a file that is neither on disk nor in the .blend.
    """
    missing = []
    for material in own_materials():
        found = [
            restore_file(socket, material.get(PROPERTIES[socket.identifier]))
            for node in script_nodes(material)
            for socket in file_sockets(node)
        ]
        if not all(found):
            missing.append(material.name)
    for name in missing:
        log.warning("%s: a shader EXR is missing; fit the material again.", name)
    return missing


def restore_file(socket: bpy.types.NodeSocket, name: object) -> bool:
    """Restore the file of a socket from its packed copy, if it is missing.

    Returns whether the socket's file exists afterwards. File names that are not Patina's are
    rejected.
    """
    if is_trusted_path(socket.default_value):
        return True
    if not name:
        return False
    if not osl_atlas.is_own_name(name):
        _warn_of_name(name)
        return False
    path = blend_folder() / name
    if is_regular_file(path) or write_packed(bpy.data.images.get(name), path):
        socket.default_value = path.as_posix()
        return True
    return False


def is_trusted_path(path: str) -> bool:
    """Whether a path from a .blend is that of one of Patina's EXRs. Network paths are not accessed:
    on Windows that would send the user's credentials to the server."""
    if path.startswith(("//", "\\\\")) or not osl_atlas.is_own_name(re.split(r"[\\/]", path)[-1]):
        return False
    return is_regular_file(Path(path))


def _warn_of_name(name: object) -> None:
    log.warning(
        "The .blend gives %.200r as a shader file, which is not a file name of Patina; nothing was "
        "written. If you trust the .blend, fit the material again.",
        name,
    )


def script_nodes(material: bpy.types.Material) -> list[bpy.types.Node]:
    """The script nodes of the material that run a Patina shader."""
    if material.node_tree is None:
        return []
    return [
        node
        for node in material.node_tree.nodes
        if node.bl_idname == "ShaderNodeScript" and SOCKET in node.inputs
    ]


def own_materials() -> list[bpy.types.Material]:
    """The materials of this .blend that have a Patina shader."""
    return [m for m in bpy.data.materials if COMPONENTS_FILE in m and m.library is None]


def own_shaders() -> list[bpy.types.Node]:
    """The Patina shaders of all materials of this .blend."""
    return [node for material in own_materials() for node in script_nodes(material)]


def redirect_files(
    material: bpy.types.Material, folder: Path, moved: Callable[[Path], bool] = lambda file: True
) -> list[Path]:
    """Point the material's shaders to EXRs in ``folder``; returns the previous paths.

    moved: called with each previous path; only files for which it returns True are redirected.
    """
    sockets = [s for node in script_nodes(material) for s in file_sockets(node)]
    old = [Path(socket.default_value) for socket in sockets]
    for socket, file in zip(sockets, old, strict=True):
        if moved(file):
            socket.default_value = (folder.absolute() / file.name).as_posix()
    return old


@persistent
def _after_load(*_: object) -> None:
    restore()


@persistent
def _after_save(*_: object) -> None:
    """Write the shader files next to the .blend after its first save."""
    for material in bpy.data.materials:
        for key in _file_properties():
            name = material.get(key)
            if not name:
                continue
            if not osl_atlas.is_own_name(name):
                _warn_of_name(name)
            elif not is_regular_file(blend_folder() / name):
                write_packed(bpy.data.images.get(name), blend_folder() / name)


HANDLERS = (("load_post", _after_load), ("save_post", _after_save))


def register() -> None:
    """Add the handlers for loading and saving."""
    attach(HANDLERS)


def unregister() -> None:
    """Remove the handlers."""
    detach(HANDLERS)
