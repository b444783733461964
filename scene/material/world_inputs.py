"""A table of the bright areas of the scene's environment image, for importance sampling in Patina
shaders.

The table reduces noise and does not change the expected image. A world without an image, or a
.blend rendered without this extension, renders the same but needs more samples.
"""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from bpy.app.handlers import persistent
from mathutils import Matrix

from ...core.appearance import osl_atlas, osl_source
from ...core.appearance.world_table import world_texels
from ...core.errors import PatinaError
from ..session.handlers import register_handlers_factory
from .osl_files import own_shaders

log = logging.getLogger(__name__)

MIN_SIDE = 4  # pixels along each side of an environment image that gets a table


@dataclass(frozen=True)
class World:
    """The inputs of a shader. path: file of the table, "" for none; rows: of the rotation from
    world space to image space."""

    path: str = ""
    rows: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def scene_world(scene: bpy.types.Scene) -> World:
    """The table of the scene's world; its file is written if it does not exist yet."""
    found = _picture(scene.world)
    if found is None:
        return World()
    image, rotation = found
    try:
        path = _table(image)
    except (PatinaError, OSError, RuntimeError) as error:
        log.warning(
            "%s: the environment image cannot be sampled by brightness (%s).", image.name, error
        )
        return World()
    if path is None:
        return World()
    return World(path.as_posix(), tuple(tuple(row) for row in rotation))


def update_worlds(scene: bpy.types.Scene) -> int:
    """Write the world into all Patina materials; returns the number of changed inputs."""
    nodes = own_shaders()
    if not nodes:
        return 0
    world = scene_world(scene)
    changed = 0
    for node in nodes:
        sockets = {socket.identifier: socket for socket in node.inputs}
        for name, value in zip(osl_source.WORLD, (world.path, *world.rows), strict=True):
            socket = sockets.get(name)
            if socket is None:
                continue
            old = socket.default_value
            same = old == value if isinstance(value, str) else np.allclose(old, value, atol=1e-6)
            if not same:
                socket.default_value, changed = value, changed + 1
    return changed


def _picture(world: bpy.types.World | None) -> tuple[bpy.types.Image, Matrix] | None:
    """(equirectangular image that lights the world, rotation from world to image space), or
    None."""
    tree = world.node_tree if world is not None else None
    if tree is None:
        return None
    output = next((n for n in tree.nodes if n.type == "OUTPUT_WORLD" and n.is_active_output), None)
    waiting = [output] if output is not None else []
    seen = set()
    while waiting:
        node = waiting.pop(0)
        if node.name in seen:
            continue
        seen.add(node.name)
        if node.type == "TEX_ENVIRONMENT" and node.image is not None:
            rotation = _rotation(node)
            usable = node.projection == "EQUIRECTANGULAR" and rotation is not None
            return (node.image, rotation) if usable else None
        waiting += [link.from_node for socket in node.inputs for link in socket.links]
    return None


def _rotation(node: bpy.types.Node) -> Matrix | None:
    """Rotation from world space to image space; None if the coordinates are transformed in another
    way."""
    if not node.inputs["Vector"].is_linked:
        return Matrix.Identity(3)
    before = node.inputs["Vector"].links[0].from_node
    if before.type == "TEX_COORD":
        return Matrix.Identity(3)
    named = [before.inputs.get(name) for name in ("Location", "Rotation", "Scale")]
    if before.type != "MAPPING" or any(s is not None and s.is_linked for s in named):
        return None
    rotation = before.inputs["Rotation"].default_value.to_matrix()
    if before.vector_type == "TEXTURE":
        rotation.transpose()
    if "Scale" in before.inputs and not np.allclose(before.inputs["Scale"].default_value, 1.0):
        return None
    moved = "Location" in before.inputs and before.vector_type in {"POINT", "TEXTURE"}
    if moved and not np.allclose(before.inputs["Location"].default_value, 0.0):
        return None
    return rotation


def _table(image: bpy.types.Image) -> Path | None:
    """The file of an image's table, in Blender's temporary folder; None without bright areas."""
    width, height = image.size
    if min(width, height) < MIN_SIDE:
        return None
    identity = (
        image.name_full,
        image.filepath,
        width,
        height,
        image.is_dirty,
        image.library is None,
    )
    name = hashlib.sha256(repr(identity).encode()).hexdigest()[:12]
    path = Path(bpy.app.tempdir) / f"patina_world_{name}.exr"
    even = path.with_suffix(".even")  # marks an image without bright areas
    if even.is_file():
        return None
    if not path.is_file():
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        found = world_texels(pixels.reshape(height, width, -1)[::-1])
        if found is None:
            even.touch()
            return None
        osl_atlas.write_picture(path, found)
    return path


@persistent
def _after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if any(isinstance(u.id, bpy.types.World | bpy.types.Scene) for u in depsgraph.updates):
        update_worlds(scene)


@persistent
def _after_load(*_: object) -> None:
    """Write the tables again: those that the file was saved with were temporary."""
    for scene in bpy.data.scenes[:1]:
        update_worlds(scene)


@persistent
def _before_render(scene: bpy.types.Scene, *_: object) -> None:
    update_worlds(scene)


HANDLERS = (
    ("depsgraph_update_post", _after_update),
    ("load_post", _after_load),
    ("render_pre", _before_render),
)
register, unregister = register_handlers_factory(HANDLERS)
