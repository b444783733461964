"""The lamp of the photo that is looked through: its kind, and where its numbers come from."""

from __future__ import annotations

import math
from typing import Any

import bpy

from ..scene.photos.dragged_lamps import by_hand, lamp_of
from ..scene.photos.lamp_placement import DISTANT, MOUNTED, NEAR
from ..scene.property_keys import CAPTURE, LAMP_KIND, LIGHT_NAME
from ..scene.session.lengths import length
from ..scene.session.scene_properties import stored_result

ICONS = {DISTANT: "LIGHT_SUN", NEAR: "LIGHT_POINT", MOUNTED: "LIGHT_SPOT"}
KINDS = {DISTANT: "Distant", NEAR: "Lamp", MOUNTED: "Flash"}


def draw_lamp(layout: bpy.types.UILayout, scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """A line for the lamp, and more where it was changed by hand or refined by the last fit."""
    capture, name = camera.get(CAPTURE, ""), camera.get(LIGHT_NAME, "")
    lamp = lamp_of(scene, capture, name)
    column = layout.column(align=True)
    if lamp is None:
        column.label(text=f"{name}: its lamp is gone", icon="LIGHT")
        return
    kind = lamp.get(LAMP_KIND)
    column.label(text=f"{KINDS.get(kind, 'Light')}: {name}", icon=ICONS.get(kind, "LIGHT"))
    hand = by_hand(scene, lamp)
    if hand:
        words = {"Moved": hand.moved, "strength": hand.strength, "size": hand.softness}
        said = ", ".join(word for word, changed in words.items() if changed)
        column.label(text=f"{said[0].upper()}{said[1:]} by hand", icon="VIEW_PAN")
        column.operator("patina.save_lights", icon="FILE_TICK")
    refined = _refined(stored_result(capture) or {}, name)
    if refined:
        column.label(text=refined, icon="CON_TRACKTO")


def _refined(result: dict[str, Any], name: str) -> str | None:
    """What the last fit has made of a light marked ``refine``."""
    light = next((one for one in result.get("lights", []) if one.get("name") == name), {})
    moved = {key: one["value"] for key, one in light.get("refined", {}).items()}
    if not moved:
        return None
    if "angle 1" in moved:
        return f"Refined by {math.degrees(math.hypot(*moved.values())):.1f}°"
    place = [f"{key} {length(value)}" for key, value in moved.items() if not key.startswith("1/")]
    return f"Refined: {', '.join(place)}"
