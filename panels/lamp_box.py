"""The lamp of the active lit photo: its kind, and whether it was edited or refined by a fit."""

from __future__ import annotations

import math
from typing import Any

import bpy

from ..scene.photos.dragged_lamps import lamp_edits, lamp_of
from ..scene.photos.lamp_knowledge import Source, lamp_knowledge
from ..scene.photos.lamp_placement import DISTANT, MOUNTED, NEAR
from ..scene.property_keys import CAPTURE, LAMP_KIND, LIGHT_NAME
from ..scene.session.lengths import length
from ..scene.session.scene_properties import stored_result
from .wrapped import wrapped

ICONS = {DISTANT: "LIGHT_SUN", NEAR: "LIGHT_POINT", MOUNTED: "LIGHT_SPOT"}
KINDS = {DISTANT: "Distant Lamp", NEAR: "Near Lamp", MOUNTED: "Flash"}


def draw_lamp(layout: bpy.types.UILayout, scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Draw a line for the lamp, and further lines if the user edited it or the last fit refined
    it."""
    capture, name = camera.get(CAPTURE, ""), camera.get(LIGHT_NAME, "")
    lamp = lamp_of(scene, capture, name)
    column = layout.column(align=True)
    if lamp is None:
        column.label(text=f"{name}: the lamp is not in the scene", icon="LIGHT")
        return
    kind = lamp.get(LAMP_KIND)
    column.label(text=f"{KINDS.get(kind, 'Light')}: {name}", icon=ICONS.get(kind, "LIGHT"))
    known = lamp_knowledge(scene, lamp)
    if known.source is Source.GUESS:
        wrapped(column, known.sentence, "ERROR")
    elif known.source is Source.FOUND:
        wrapped(column, known.sentence, "BLANK1")
        column.operator("patina.find_lights", text="Find Again from Photos").light = name
    if kind == DISTANT:
        column.operator("patina.find_ball", text="Find from Ball in This Photo")
    hand = lamp_edits(scene, lamp)
    if hand:
        moved = hand.moved and known.source is not Source.FOUND
        edits = {"position": moved, "strength": hand.strength, "size": hand.softness}
        edited = ", ".join(word for word, changed in edits.items() if changed)
        if edited:
            column.label(text=f"{edited[0].upper()}{edited[1:]} edited", icon="VIEW_PAN")
        column.operator("patina.save_lights", icon="FILE_TICK")
    refined = _refined(stored_result(capture) or {}, name)
    if refined:
        column.label(text=refined, icon="CON_TRACKTO")


def _refined(result: dict[str, Any], name: str) -> str | None:
    """How the last fit changed a light that is marked ``refine``; None if it did not."""
    light = next((entry for entry in result.get("lights", []) if entry.get("name") == name), {})
    moved = {key: entry["value"] for key, entry in light.get("refined", {}).items()}
    if not moved:
        return None
    if "angle 1" in moved:
        return f"Refined by {math.degrees(math.hypot(*moved.values())):.1f}°"
    place = [f"{key} {length(value)}" for key, value in moved.items() if not key.startswith("1/")]
    return f"Refined: {', '.join(place)}"
