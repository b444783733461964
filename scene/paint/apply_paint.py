"""Apply all painted strokes, before a fit and before an export."""

from __future__ import annotations

import bpy

from ..session.scene_properties import capture_path
from .canvas import apply_photo_strokes
from .mesh_paint import apply_mesh_strokes, show_on_mesh, shown_on_mesh


def apply_strokes(scene: bpy.types.Scene) -> tuple[int, int]:
    """Apply strokes on the mesh and on photos; returns the numbers (faces, pixels) painted since
    the last call. Raises PatinaError if the mesh no longer has the scan's faces."""
    mesh, faces = scene.patina.mesh, 0
    if mesh is not None and mesh.type == "MESH":
        faces = apply_mesh_strokes(scene, mesh)
        if faces:
            scene.patina.use_slots = True
    pixels = apply_photo_strokes(scene, capture_path(scene))
    if pixels and mesh is not None and shown_on_mesh(mesh):
        show_on_mesh(scene, mesh)  # a stroke on a photo may have changed it
    return faces, pixels
