"""Which face is of which material, as the artist sees and repaints it: the mesh's slots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture import Capture, MaterialEntry
from ...core.capture.model import LEFT_OUT
from ...core.errors import InputError, PatinaError
from ...core.scan import Scan
from ..property_keys import (
    CAPTURE,
    FIT_SLOTS,
    MEASURED_NAME,
    PLACEHOLDER,
    PROPOSAL_CONFIDENCE,
    PROPOSED_SLOTS,
)

# tell apart with any eyes (Okabe & Ito 2008), linear
COLOURS = (
    (0.788, 0.347, 0.0), (0.093, 0.456, 0.815), (0.0, 0.342, 0.171), (0.871, 0.776, 0.054),
    (0.0, 0.168, 0.445), (0.665, 0.112, 0.0), (0.604, 0.191, 0.386), (0.2, 0.2, 0.2),
)  # fmt: skip
FIRST = "surface"  # what a scan is of before anything is painted
FORBIDDEN = set('/\\:*?"<>|')

Prepare = Callable[[Scan], Scan]


def show_proposal(
    target: bpy.types.Object,
    capture: str,
    labels: NDArray[np.int32],
    confidence: NDArray[np.float32],
    names: Sequence[str],
) -> None:
    """Proposed materials as coloured slots of the scanned mesh, and as face attributes.

    Raises PatinaError where the mesh no longer has the scan's faces.
    """
    leave_edit_mode(target)
    data = target.data
    if len(data.polygons) != len(labels):
        raise PatinaError(
            f"{target.name} has {len(data.polygons):,} faces, the scan {len(labels):,}: import the "
            "capture anew, or undo what cut the mesh"
        )
    face_attribute(data, PROPOSED_SLOTS, "INT", labels.astype(np.int32))
    face_attribute(data, PROPOSAL_CONFIDENCE, "FLOAT", confidence.astype(np.float32))
    data.materials.clear()
    for number, name in enumerate(names):
        data.materials.append(stand_in(name, COLOURS[number % len(COLOURS)], capture))
    data.polygons.foreach_set("material_index", labels.astype(np.int32))
    data.update()
    drop_stand_ins(capture)


def drop_stand_ins(capture: str) -> None:
    """Of that capture those that nothing wears any more."""
    for material in [
        m for m in bpy.data.materials if m.get(PLACEHOLDER) == capture and not m.users
    ]:
        bpy.data.materials.remove(material)


def new_slot(scene: bpy.types.Scene, capture: str, name: str) -> int:
    """One more slot of the scanned mesh, with a coloured material; its number. The first one asked
    for comes beside one that all faces wear: a scan's own material says nothing of what is what."""
    mesh = scene.patina.mesh
    leave_edit_mode(mesh)
    data = mesh.data
    if not scene.patina.use_slots and not data.materials.get(FIRST):
        data.materials.clear()
        data.materials.append(stand_in(FIRST, COLOURS[0], capture))
        data.polygons.foreach_set("material_index", np.zeros(len(data.polygons), np.int32))
        scene.patina.use_slots = True
    number = len(data.materials)
    said = name or f"material_{number + 1}"
    data.materials.append(stand_in(said, COLOURS[number % len(COLOURS)], capture))
    return number


def wear_again(mesh: bpy.types.Object, capture: str) -> None:
    """What an earlier mesh of the same capture wore, on one that was imported anew: deleted objects
    leave their mesh behind as long as the file is open."""
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


def with_painted_slots(capture: Capture, scene: bpy.types.Scene) -> tuple[Capture, Prepare | None]:
    """(the capture with a material for every slot that faces wear, what brings the slots to its
    scan). Where the artist has not accepted the slots (Scene.patina.use_slots): as it was, None.

    The capture's own materials and their masks give way; masks of what is left out stay. Raises
    PatinaError where there is nothing to take slots from.
    """
    if not scene.patina.use_slots:
        return capture, None
    target = scene.patina.mesh
    if target is None or target.type != "MESH" or target.name not in scene.objects:
        raise PatinaError("the scanned mesh is not in this scene: there are no slots to fit")
    if target.mode == "EDIT":
        target.update_from_editmode()
    data = target.data
    slot = np.empty(len(data.polygons), np.int32)
    data.polygons.foreach_get("material_index", slot)
    if not len(slot) or not any(data.materials):
        raise PatinaError(f"{target.name} has no material slots: propose materials, or make some")
    used, place = np.unique(np.clip(slot, 0, len(data.materials) - 1), return_inverse=True)
    names = [_capture_name(data.materials[number], int(number)) for number in used]
    for i, name in enumerate(names):
        if name.casefold() in [other.casefold() for other in names[:i]]:
            raise PatinaError(f"two slots of {target.name} wear {name!r}: give them two materials")
    photos = tuple(
        replace(photo, masks={k: v for k, v in photo.masks.items() if k in LEFT_OUT})
        for photo in capture.photos
    )
    materials = tuple(MaterialEntry(name, faces=FIT_SLOTS) for name in names)
    faces = place.ravel().astype(np.int32)
    return replace(capture, materials=materials, photos=photos), _bring(faces, target.name)


def shown_name(material: bpy.types.Material) -> str:
    """Without the number that Blender gives a measured material whose stand-in is still there."""
    return str(material.get(MEASURED_NAME, material.name))


def leave_edit_mode(target: bpy.types.Object) -> None:
    """End the edit session that a mesh's faces belong to while it lasts."""
    if target.data.is_editmode:
        with bpy.context.temp_override(active_object=target, object=target):
            bpy.ops.object.mode_set(mode="OBJECT")


def _bring(faces: NDArray[np.int32], name: str) -> Prepare:
    def prepare(scan: Scan) -> Scan:
        if len(scan.mesh.faces) != len(faces):
            raise InputError(
                f"{name} has {len(faces):,} faces, the scan {len(scan.mesh.faces):,}: its slots "
                "say nothing about the scan; import the capture anew, or do without the slots"
            )
        attributes = {**scan.mesh.face_attributes, FIT_SLOTS: faces}
        return replace(scan, mesh=replace(scan.mesh, face_attributes=attributes))

    return prepare


def _capture_name(material: bpy.types.Material | None, slot: int) -> str:
    """A material's name as a capture file may have it: part of file names on every system."""
    if material is None:
        return f"slot_{slot + 1}"
    name = shown_name(material)
    safe = "".join("_" if c in FORBIDDEN or not c.isprintable() else c for c in name).strip(". ")
    return f"slot_{slot + 1}" if not safe or safe in LEFT_OUT else safe[:60]


def face_attribute(data: bpy.types.Mesh, name: str, kind: str, values: NDArray) -> None:
    """Values (faces,) as an attribute of a mesh's faces, in place of one of that name."""
    old = data.attributes.get(name)
    if old is not None and (old.domain != "FACE" or old.data_type != kind):
        data.attributes.remove(old)
        old = None
    if old is None:
        old = data.attributes.new(name, kind, "FACE")
    old.data.foreach_set("value", values)


def stand_in(name: str, colour: tuple[float, float, float], capture: str) -> bpy.types.Material:
    """A coloured material of that name; one that an earlier proposal made is used again."""
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
