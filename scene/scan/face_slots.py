"""The material of each face, which the user sees and paints as material slots of the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture import Capture, MaterialEntry
from ...core.capture.model import EXCLUDED_MASKS
from ...core.errors import PatinaError
from ...core.inputs.face_slots import FaceSlots
from ..property_keys import (
    CAPTURE,
    FIT_SLOTS,
    MEASURED_NAME,
    PLACEHOLDER,
    PROPOSAL_CONFIDENCE,
    PROPOSED_SLOTS,
)

# distinguishable with colour vision deficiency (Okabe & Ito 2008), linear
COLOURS = (
    (0.788, 0.347, 0.0), (0.093, 0.456, 0.815), (0.0, 0.342, 0.171), (0.871, 0.776, 0.054),
    (0.0, 0.168, 0.445), (0.665, 0.112, 0.0), (0.604, 0.191, 0.386), (0.2, 0.2, 0.2),
)  # fmt: skip
FIRST_MATERIAL = "surface"  # name of the only material before any is painted
FORBIDDEN = set('/\\:*?"<>|')  # characters that file names cannot have on all systems


def show_proposal(
    target: bpy.types.Object,
    capture: str,
    labels: NDArray[np.int32],
    confidence: NDArray[np.float32],
    names: Sequence[str],
) -> None:
    """Store proposed materials as coloured slots of the scanned mesh and as face attributes.

    labels: (faces,) material of each face; confidence: (faces,) of the labels; names: of the
    materials. Raises PatinaError if the mesh no longer has the scan's faces.
    """
    leave_edit_mode(target)
    data = target.data
    if len(data.polygons) != len(labels):
        raise PatinaError(
            f"{target.name} has {len(data.polygons):,} faces, the scan has {len(labels):,}; import "
            "the capture again, or undo the edit of the mesh"
        )
    face_attribute(data, PROPOSED_SLOTS, "INT", labels.astype(np.int32))
    face_attribute(data, PROPOSAL_CONFIDENCE, "FLOAT", confidence.astype(np.float32))
    data.materials.clear()
    for number, name in enumerate(names):
        data.materials.append(placeholder_material(name, COLOURS[number % len(COLOURS)], capture))
    data.polygons.foreach_set("material_index", labels.astype(np.int32))
    data.update()
    remove_placeholders(capture)


def remove_placeholders(capture: str) -> None:
    """Remove the placeholder materials of a capture that nothing uses."""
    for material in [
        m for m in bpy.data.materials if m.get(PLACEHOLDER) == capture and not m.users
    ]:
        bpy.data.materials.remove(material)


def new_slot(scene: bpy.types.Scene, capture: str, name: str) -> int:
    """Add a slot with a coloured material to the scanned mesh; returns its index.

    The first call replaces the scan's own material by a placeholder that all faces get, and adds
    the new slot to it.
    """
    mesh = scene.patina.mesh
    leave_edit_mode(mesh)
    data = mesh.data
    if not scene.patina.use_slots and not data.materials.get(FIRST_MATERIAL):
        data.materials.clear()
        data.materials.append(placeholder_material(FIRST_MATERIAL, COLOURS[0], capture))
        data.polygons.foreach_set("material_index", np.zeros(len(data.polygons), np.int32))
        scene.patina.use_slots = True
    number = len(data.materials)
    label = name or f"material_{number + 1}"
    data.materials.append(placeholder_material(label, COLOURS[number % len(COLOURS)], capture))
    return number


def reassign_slots(mesh: bpy.types.Object, capture: str) -> None:
    """Assign the materials of an earlier mesh of the same capture to one that was imported again.
    The mesh of a deleted object remains until the file is closed."""
    data = mesh.data
    count = len(data.polygons)
    for other in bpy.data.meshes:
        if other.get(CAPTURE) == capture and len(other.polygons) == count and other.materials:
            slots = np.empty(count, np.int32)
            other.polygons.foreach_get("material_index", slots)
            for material in other.materials:
                data.materials.append(material)
            data.polygons.foreach_set("material_index", slots)
            data.update()
            break
    data[CAPTURE] = capture


def with_painted_slots(
    capture: Capture, scene: bpy.types.Scene
) -> tuple[Capture, FaceSlots | None]:
    """(the capture with a material for every used slot, function that adds the slots to its scan).

    If the user has not enabled the slots (Scene.patina.use_slots), the result is (capture, None).
    The slots replace the capture's own materials and their masks; masks of excluded areas stay.
    Raises PatinaError if there are no slots to read.
    """
    if not scene.patina.use_slots:
        return capture, None
    target = scene.patina.mesh
    if target is None or target.type != "MESH" or target.name not in scene.objects:
        raise PatinaError(
            "The scanned mesh is not in this scene, so there are no slots to fit; import the "
            "capture again"
        )
    if target.mode == "EDIT":
        target.update_from_editmode()
    data = target.data
    slot = np.empty(len(data.polygons), np.int32)
    data.polygons.foreach_get("material_index", slot)
    if not len(slot) or not any(data.materials):
        raise PatinaError(f"{target.name} has no material slots; propose or add materials")
    used, place = np.unique(np.clip(slot, 0, len(data.materials) - 1), return_inverse=True)
    names = [_capture_name(data.materials[number], int(number)) for number in used]
    for i, name in enumerate(names):
        if name.casefold() in [other.casefold() for other in names[:i]]:
            raise PatinaError(
                f"Two slots of {target.name} have the material {name!r}; assign different materials"
            )
    photos = tuple(
        replace(photo, masks={k: v for k, v in photo.masks.items() if k in EXCLUDED_MASKS})
        for photo in capture.photos
    )
    materials = tuple(MaterialEntry(name, faces=FIT_SLOTS) for name in names)
    faces = place.ravel().astype(np.int32)
    return replace(capture, materials=materials, photos=photos), FaceSlots(
        FIT_SLOTS, faces, target.name
    )


def shown_name(material: bpy.types.Material) -> str:
    """The name of a material without the number that Blender appends to a measured material while
    its placeholder exists."""
    return str(material.get(MEASURED_NAME, material.name))


def leave_edit_mode(target: bpy.types.Object) -> None:
    """Leave Edit Mode, in which a mesh's faces cannot be changed."""
    if target.data.is_editmode:
        with bpy.context.temp_override(active_object=target, object=target):
            bpy.ops.object.mode_set(mode="OBJECT")


def _capture_name(material: bpy.types.Material | None, slot: int) -> str:
    """A material's name as allowed in a capture file, where it becomes part of file names."""
    if material is None:
        return f"slot_{slot + 1}"
    name = shown_name(material)
    safe = "".join("_" if c in FORBIDDEN or not c.isprintable() else c for c in name).strip(". ")
    return f"slot_{slot + 1}" if not safe or safe in EXCLUDED_MASKS else safe[:60]


def face_attribute(data: bpy.types.Mesh, name: str, kind: str, values: NDArray) -> None:
    """Store values (faces,) as a face attribute of a mesh, in place of one of that name."""
    old = data.attributes.get(name)
    if old is not None and (old.domain != "FACE" or old.data_type != kind):
        data.attributes.remove(old)
        old = None
    if old is None:
        old = data.attributes.new(name, kind, "FACE")
    old.data.foreach_set("value", values)


def placeholder_material(
    name: str, colour: tuple[float, float, float], capture: str
) -> bpy.types.Material:
    """A coloured placeholder material of that name; an existing one is used again."""
    for material in bpy.data.materials:
        if material.get(PLACEHOLDER) == capture and material.name == name:
            return material
    material = bpy.data.materials.new(name)
    material[PLACEHOLDER] = capture
    material.diffuse_color = (*colour, 1.0)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    shader = next((n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if shader is not None:
        shader.inputs["Base Color"].default_value = (*colour, 1.0)
        shader.inputs["Roughness"].default_value = 0.8
    return material
