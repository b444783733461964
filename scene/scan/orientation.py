"""Set a scan upright: one rotation of its mesh, cameras and lamps together, about Blender's origin.

The rotation is only that of the objects. The scan's frame stays that of the mesh's data, in which
lamps are read back (dragged_lamps.py), so that it does not count as an edit of a lamp.
"""

from __future__ import annotations

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ...core.scan.up_axis import UpAxis, rotation_to_z
from ..photos.lamp_placement import MOUNTED
from ..property_keys import APPLIED_UP, CAPTURE, FOUND_UP, LAMP_KIND
from ..session.handlers import register_property_factory

Array = NDArray[np.float64]

FOUND = "FOUND"
AXES: dict[str, Array] = {
    "X": np.array([1.0, 0.0, 0.0]),
    "Y": np.array([0.0, 1.0, 0.0]),
    "Z": np.array([0.0, 0.0, 1.0]),
    "NEG_X": np.array([-1.0, 0.0, 0.0]),
    "NEG_Y": np.array([0.0, -1.0, 0.0]),
    "NEG_Z": np.array([0.0, 0.0, -1.0]),
}
ITEMS = (
    (FOUND, "Found", "Upright by the cameras: the horizontal axes of the photos are level"),
    ("X", "X", "The X axis of the scan points up"),
    ("Y", "Y", "The Y axis of the scan points up"),
    ("Z", "Z", "The Z axis of the scan points up, as in the files of the scan"),
    ("NEG_X", "−X", "The X axis of the scan points down"),
    ("NEG_Y", "−Y", "The Y axis of the scan points down"),
    ("NEG_Z", "−Z", "The Z axis of the scan points down"),
)


def _changed(state: PatinaOrientation, context: bpy.types.Context) -> None:
    set_upright(state.id_data)


class PatinaOrientation(bpy.types.PropertyGroup):
    """Scene.patina_orientation."""

    up_axis: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Up Axis",
        description="Direction of the scan that points up. Mesh, cameras and lamps turn together; "
        "the fit does not change",
        items=ITEMS,
        options=set(),
        update=_changed,
    )


def store_found(collection: bpy.types.Collection, found: UpAxis | None) -> None:
    """Store the up axis that was found on the collection of a new scan."""
    collection[APPLIED_UP] = AXES["Z"].tolist()
    if found is not None:
        collection[FOUND_UP] = [*found.direction, found.standard_error, found.agreement]


def found_up(collection: bpy.types.Collection) -> UpAxis | None:
    """The up axis that was found when the scan was imported; None if there is none."""
    values = np.array(collection.get(FOUND_UP, ()), np.float64)
    if values.shape != (5,) or not np.isfinite(values).all():
        return None
    length = float(np.linalg.norm(values[:3]))
    return UpAxis(values[:3] / length, *values[3:].tolist()) if length > 0.5 else None


def scan_collections(scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    """The collections of imported scans in a scene."""
    return [c for c in scene.collection.children_recursive if APPLIED_UP in c]


def set_upright(scene: bpy.types.Scene) -> None:
    """Turn the scans of a scene so that the axis that the user has chosen points up."""
    for collection in scan_collections(scene):
        orient(scene, collection, scene.patina_orientation.up_axis)


def orient(scene: bpy.types.Scene, collection: bpy.types.Collection, axis: str) -> None:
    """Turn a scan so that an axis of its frame points up in Blender.

    axis: one of ITEMS. An axis that was not found reliably leaves the scan as in its files.
    """
    up = AXES["Z"]
    found = found_up(collection)
    if axis != FOUND:
        up = AXES[axis]
    elif found is not None and found.reliable:
        up = found.direction
    before = np.array(collection.get(APPLIED_UP, AXES["Z"]), np.float64)
    if before.shape != (3,) or abs(np.linalg.norm(before) - 1) > 1e-3:
        before = AXES["Z"]
    collection[APPLIED_UP] = up.tolist()
    turn = np.eye(4)
    turn[:3, :3] = rotation_to_z(up) @ rotation_to_z(before).T
    if np.allclose(turn, np.eye(4), atol=1e-9):
        return
    matrix = mathutils.Matrix(turn.tolist())
    for thing in _outermost(scene, collection):
        thing.matrix_basis = matrix @ thing.matrix_basis


def _outermost(scene: bpy.types.Scene, collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """The objects of a scan that no other one carries. A flash that no camera carries yet holds its
    place relative to a camera, and is left as it is."""
    capture = collection.get(CAPTURE)
    own = {o.name: o for o in collection.all_objects}
    if capture is not None:
        own |= {o.name: o for o in scene.objects if o.get(CAPTURE) == capture}
    return [
        o
        for o in own.values()
        if (o.parent is None or o.parent.name not in own)
        and not (o.parent is None and o.get(LAMP_KIND) == MOUNTED)
    ]


register, unregister = register_property_factory(
    bpy.types.Scene, "patina_orientation", PatinaOrientation
)
