"""The paints: the materials of the scanned mesh, and the masks of photos."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture.model import EXCLUDED_MASKS
from ...core.photo.transfer import SRGB
from ...core.views.display import srgb
from ..scan.face_slots import COLOURS, shown_name

MASK_COLOURS = {"shadow": (91, 42, 134), "highlight": (255, 255, 255), "ignore": (255, 0, 160)}
ERASER = (0, 255, 255)  # not black, which an image has if Blender has freed its pixels
ERASE = "erase"
DARKENING = 0.4  # factor between repetitions of the colours, linear


@dataclass(frozen=True)
class Paint:
    """One paint.

    kind: "material", one of EXCLUDED_MASKS, or "erase" (removes masks). slot: of the scanned mesh,
    −1 for none. colour: 8-bit sRGB, different for every paint.
    """

    kind: str
    name: str
    slot: int
    colour: tuple[int, int, int]


def paints(scene: bpy.types.Scene) -> list[Paint]:
    """Materials in the order of their slots, then the kinds of masks, then the eraser."""
    found = []
    mesh = scene.patina.mesh
    for number, slot in enumerate(mesh.material_slots if mesh is not None else ()):
        name = shown_name(slot.material) if slot.material else f"Slot {number + 1}"
        found.append(Paint("material", name, number, slot_colour(number)))
    for kind in EXCLUDED_MASKS:
        found.append(Paint(kind, kind.capitalize(), -1, MASK_COLOURS[kind]))
    return [*found, Paint(ERASE, "Erase", -1, ERASER)]


def slot_colour(number: int) -> tuple[int, int, int]:
    """8-bit sRGB colour of a slot. The viewport colour of the material is not used, because two
    materials may have the same."""
    repetition, index = divmod(number, len(COLOURS))
    red, green, blue = srgb(np.array(COLOURS[index]) * DARKENING**repetition).tolist()
    return red, green, blue


def palette(found: list[Paint]) -> NDArray[np.uint8]:
    """(k, 3) colours of the paints, 8-bit sRGB."""
    return np.array([paint.colour for paint in found], np.uint8)


def slots_of_faces(mesh: bpy.types.Object) -> NDArray[np.int32]:
    """(faces,) material slot of each face."""
    out = np.empty(len(mesh.data.polygons), np.int32)
    mesh.data.polygons.foreach_get("material_index", out)
    return np.clip(out, 0, max(len(mesh.material_slots) - 1, 0))


def assign_slots(mesh: bpy.types.Object, slots: NDArray[np.int32]) -> None:
    """Set the material slots (faces,) of the faces."""
    mesh.data.polygons.foreach_set("material_index", slots.astype(np.int32))
    mesh.data.update()


def update_brushes(context: bpy.types.Context) -> None:
    """Set the colour of Blender's brushes for meshes and images to the active paint."""
    kinds = paints(context.scene)
    paint = kinds[min(context.scene.patina_paint.active, len(kinds) - 1)]
    linear = _linear(paint.colour)
    settings = context.tool_settings
    for mode in (settings.vertex_paint, settings.image_paint):
        if mode is None:
            continue
        shared = getattr(mode, "unified_paint_settings", None)  # per mode from Blender 5.0
        shared = settings.unified_paint_settings if shared is None else shared
        for holder in (shared, mode.brush):
            if holder is not None:
                holder.color = _of_brush(paint.colour, linear)
        if mode.brush is not None:
            mode.brush.blend = "MIX"


def _of_brush(colour: tuple[int, int, int], linear: NDArray[np.float64]) -> tuple[float, ...]:
    """The value of a brush's colour: sRGB before Blender 5.0, linear since."""
    if bpy.app.version < (5, 0):
        return tuple(c / 255 for c in colour)
    return tuple(linear.tolist())


def _linear(colour: tuple[int, int, int]) -> NDArray[np.float64]:
    return SRGB(np.array(colour) / 255)
