"""All that was painted, taken where it belongs: before a fit, and before anything is exported."""

from __future__ import annotations

import bpy

from ..session.scene_properties import capture_path
from .canvas import take_strokes
from .mesh_paint import show_on_mesh, shown_on_mesh, take_from_mesh


def take_all(scene: bpy.types.Scene) -> tuple[int, int]:
    """(faces, pixels) that were painted on the mesh and on photos since they were taken last.
    Raises PatinaError where the mesh is not the scan's any more."""
    mesh, faces = scene.patina.mesh, 0
    if mesh is not None and mesh.type == "MESH":
        faces = take_from_mesh(scene, mesh)
        if faces:
            scene.patina.use_slots = True
    pixels = take_strokes(scene, capture_path(scene))
    if pixels and mesh is not None and shown_on_mesh(mesh):
        show_on_mesh(scene, mesh)  # a stroke on a photo may have changed it
    return faces, pixels
