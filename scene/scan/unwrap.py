"""Texture coordinates for a scan without any, by Blender's Smart UV Project."""

from __future__ import annotations

import math

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import PatinaError
from ...core.scan import Mesh
from .meshes import UV_LAYER, create_mesh_object

ANGLE = math.radians(66.0)  # maximum angle between normals within an island
MARGIN = 0.003  # between islands, relative to the texture's size


def unwrapped(mesh: Mesh) -> NDArray[np.float32]:
    """(f, 3, 2) texture coordinates of every face's corners.

    Works in a temporary scene; the open one is not changed. Raises PatinaError if Blender cannot
    unwrap the mesh.
    """
    scene = bpy.data.scenes.new("patina_unwrap")
    origin = mesh.vertices.mean(axis=0)
    made = create_mesh_object("patina_unwrap", _bare(mesh), origin, scene.collection)
    data = made.data
    try:
        if len(data.polygons) != len(mesh.faces):
            raise PatinaError(
                "Blender removed faces of the mesh, so it cannot be unwrapped; export it with UVs"
            )
        data.uv_layers.new(name=UV_LAYER)
        layer = scene.view_layers[0]
        layer.update()
        layer.objects.active = made
        made.select_set(True, view_layer=layer)
        with bpy.context.temp_override(
            scene=scene, view_layer=layer, active_object=made, object=made, edit_object=made
        ):
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.smart_project(angle_limit=ANGLE, island_margin=MARGIN)
            bpy.ops.object.mode_set(mode="OBJECT")
        found = np.empty(6 * len(mesh.faces), np.float32)
        data.uv_layers[UV_LAYER].uv.foreach_get("vector", found)
    except RuntimeError as error:
        raise PatinaError(f"the mesh cannot be unwrapped ({error}); export it with UVs") from error
    finally:
        bpy.data.objects.remove(made)
        bpy.data.meshes.remove(data)
        bpy.data.scenes.remove(scene)
    if not np.isfinite(found).all() or np.ptp(found) <= 0:
        raise PatinaError("Blender created no texture coordinates for the mesh; export it with UVs")
    return found.reshape(-1, 3, 2)


def _bare(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces)
