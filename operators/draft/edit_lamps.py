"""Scan stage: the lamps of a new capture, and cancelling it."""

from __future__ import annotations

import bpy

from ...scene.scan.capture_draft import clear_draft

ONE, EACH, ADD = "ONE", "EACH", "ADD"
WAYS = {
    ONE: ("One Lamp for All", "All photos share one lamp"),
    EACH: ("One Lamp per Photo", "Each photo has a lamp of its own"),
    ADD: ("Add Lamp", "Add a lamp for the active photo"),
}
"""Identifier → (label, tooltip)."""


class PATINA_OT_draft_lamps(bpy.types.Operator):
    """Change which photos share a lamp"""

    bl_idname = "patina.draft_lamps"
    bl_label = "Group Photos by Lamp"
    bl_options = {"REGISTER", "UNDO"}

    way: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Lamps",
        description="Which photos share a lamp",
        items=[(way, label, tooltip) for way, (label, tooltip) in WAYS.items()],
    )

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.AnyType) -> str:
        """The tooltip of the chosen way."""
        return WAYS[properties.way][1]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return len(context.scene.patina_draft.photos) > 0

    def execute(self, context: bpy.types.Context) -> set[str]:
        state = context.scene.patina_draft
        if self.way == ADD:
            photo = state.photos[min(state.active_photo, len(state.photos) - 1)]
            photo.lamp = _new_lamp(state)
            return {"FINISHED"}
        kind = state.lamps[0].kind if self.way == ONE and len(state.lamps) else None
        state.lamps.clear()
        if self.way == ONE:
            name = _new_lamp(state)
            if kind is not None:
                state.lamps[0].kind = kind
        for photo in state.photos:
            if self.way == EACH:
                name = _new_lamp(state)
            photo.lamp = name
        return {"FINISHED"}


class PATINA_OT_cancel_draft(bpy.types.Operator):
    """Close the new capture without writing it"""

    bl_idname = "patina.cancel_draft"
    bl_label = "Cancel New Capture"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        clear_draft(context.scene)
        return {"FINISHED"}


def _new_lamp(state: bpy.types.PropertyGroup) -> str:
    """Add a lamp with an unused name; returns the name."""
    number = len(state.lamps) + 1
    while f"lamp {number}" in state.lamps:
        number += 1
    lamp = state.lamps.add()
    lamp.name = f"lamp {number}"
    return lamp.name


CLASSES = (PATINA_OT_draft_lamps, PATINA_OT_cancel_draft)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
