"""What can be painted: the materials of the scanned mesh, and what is left out of photos."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture.model import LEFT_OUT
from ...core.photo.transfer import SRGB
from ...core.views.display import srgb
from ..scan.face_slots import COLOURS, shown_name

OUT_COLOURS = {"shadow": (91, 42, 134), "highlight": (255, 255, 255), "ignore": (255, 0, 160)}
ERASER = (0, 255, 255)  # never black: that is an image whose pixels Blender let go
ERASE = "erase"
DARKER = 0.4  # from one round of colours to the next


@dataclass(frozen=True)
class Paint:
    """kind: "material", one of LEFT_OUT, or "erase" (of what is left out). slot: of the scanned
    mesh, −1 for none. colour: 8-bit sRGB, unlike every other paint's."""

    kind: str
    name: str
    slot: int
    colour: tuple[int, int, int]


def paints(scene: bpy.types.Scene) -> list[Paint]:
    """Materials in the order of their slots, then what is left out, then the eraser."""
    found = []
    mesh = scene.patina.mesh
    for number, slot in enumerate(mesh.material_slots if mesh is not None else ()):
        name = shown_name(slot.material) if slot.material else f"Slot {number + 1}"
        found.append(Paint("material", name, number, slot_colour(number)))
    for kind in LEFT_OUT:
        found.append(Paint(kind, kind.capitalize(), -1, OUT_COLOURS[kind]))
    return [*found, Paint(ERASE, "Erase", -1, ERASER)]


def slot_colour(number: int) -> tuple[int, int, int]:
    """8-bit sRGB: a measured material has a colour of its own, which may be another's, too."""
    often, place = divmod(number, len(COLOURS))
    red, green, blue = srgb(np.array(COLOURS[place]) * DARKER**often).tolist()
    return red, green, blue


def palette(found: list[Paint]) -> NDArray[np.uint8]:
    """(k, 3) their colours."""
    return np.array([paint.colour for paint in found], np.uint8)


def worn_slots(mesh: bpy.types.Object) -> NDArray[np.int32]:
    """(faces,) which slot each face wears."""
    out = np.empty(len(mesh.data.polygons), np.int32)
    mesh.data.polygons.foreach_get("material_index", out)
    return np.clip(out, 0, max(len(mesh.material_slots) - 1, 0))


def wear(mesh: bpy.types.Object, slots: NDArray[np.int32]) -> None:
    """(faces,) the slots that the faces wear from now on."""
    mesh.data.polygons.foreach_set("material_index", slots.astype(np.int32))
    mesh.data.update()


def take_up(context: bpy.types.Context) -> None:
    """Blender's brushes get the colour of the active paint, for meshes and for images."""
    there = paints(context.scene)
    paint = there[min(context.scene.patina_paint.active, len(there) - 1)]
    linear = _linear(paint.colour)
    settings = context.tool_settings
    for mode in (settings.vertex_paint, settings.image_paint):
        if mode is None:
            continue
        shared = getattr(mode, "unified_paint_settings", None)  # of each mode from Blender 5 on
        shared = settings.unified_paint_settings if shared is None else shared
        for holder in (shared, mode.brush):
            if holder is not None:
                holder.color = _of_brush(paint.colour, linear)
        if mode.brush is not None:
            mode.brush.blend = "MIX"


def _of_brush(colour: tuple[int, int, int], linear: NDArray[np.float64]) -> tuple[float, ...]:
    """Brushes hold what is on the screen until Blender 5, light since."""
    if bpy.app.version < (5, 0):
        return tuple(c / 255 for c in colour)
    return tuple(linear.tolist())


def _linear(colour: tuple[int, int, int]) -> NDArray[np.float64]:
    return SRGB(np.array(colour) / 255)
