"""Hide objects that enclose a new scan, such as the cube of Blender's startup file."""

from __future__ import annotations

import bpy
import mathutils

from ..property_keys import CAPTURE

SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}


def hide_enclosing(scene: bpy.types.Scene, mesh: bpy.types.Object) -> list[str]:
    """Hide the visible objects of the scene whose bounding box contains the centre of the scanned
    mesh. Returns their names."""
    centre = sum((mathutils.Vector(c) for c in mesh.bound_box), mathutils.Vector()) / 8
    centre = mesh.matrix_world @ centre
    own = {o for c in mesh.users_collection for o in c.all_objects}
    hidden = []
    for other in scene.objects:
        if other in own or other.type not in SURFACES or CAPTURE in other or other.hide_get():
            continue
        corners = [other.matrix_world @ mathutils.Vector(c) for c in other.bound_box]
        low = [min(c[k] for c in corners) for k in range(3)]
        high = [max(c[k] for c in corners) for k in range(3)]
        if all(low[k] <= centre[k] <= high[k] for k in range(3)):
            other.hide_set(True)
            other.hide_render = True
            hidden.append(other.name)
    return hidden
