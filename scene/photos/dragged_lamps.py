"""Detect the user's edits of a capture's lamps, and apply them to the capture."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture import Capture, LightEntry
from ...core.errors import PatinaError
from ..property_keys import (
    CAPTURE,
    INTENSITY_KNOWN,
    LAMP_KIND,
    LIGHT_GUESS,
    LIGHT_NAME,
    STATED_ERROR,
)
from . import lamp_placement
from .capture_collection import collections_of
from .found_lights import found_strength, found_values, scan_origin
from .lamp_placement import DISTANT, FROM_CAMERA, MOUNTED, NEAR, Placement

Array = NDArray[np.float64]

# smaller changes are rounding errors of Blender's float32
MIN_ROTATION = 1e-4  # radians
MIN_TRANSLATION = 4e-6  # relative to the largest coordinate
MIN_RELATIVE_CHANGE = 1e-5  # of a strength or a size
LAMP_TYPE = {DISTANT: "SUN", NEAR: "POINT", MOUNTED: "POINT"}


@dataclass(frozen=True)
class LampEdits:
    """Edits of a lamp since its import. now: its present placement, in the mesh's frame."""

    now: Placement
    moved: bool
    strength: bool
    softness: bool

    def __bool__(self) -> bool:
        return self.moved or self.strength or self.softness


def lamp_of(scene: bpy.types.Scene, capture: str, light: str) -> bpy.types.Object | None:
    """The lamp of a capture's light in a scene, or None. Of several copies, the one with the name
    of the light, else the first by name."""
    found = [
        o
        for o in scene.objects
        if o.type == "LIGHT" and o.get(CAPTURE) == capture and o.get(LIGHT_NAME) == light
    ]
    return min(found, key=lambda o: (o.name != light, o.name), default=None)


def lamp_edits(scene: bpy.types.Scene, lamp: bpy.types.Object) -> LampEdits | None:
    """The user's edits of a lamp; None if the lamp no longer has the type that was imported.

    A lamp that kept its place in the world, or relative to the mesh, does not count as moved: the
    user may rotate or scale the whole scan together with its lamps.
    """
    made, kind = lamp_placement.imported_placement(lamp), lamp.get(LAMP_KIND)
    if made is None or LAMP_TYPE.get(kind) != lamp.data.type:
        return None
    now = lamp_placement.placement_of(lamp, scene)
    if not all(np.isfinite(now.values)) or np.linalg.norm(now.axis) < 0.5:  # scaled to nothing
        return None
    moved = _differs(kind, now, made)
    if kind != MOUNTED:
        seen = now.within(mesh_frame(scene, lamp.get(CAPTURE)))
        moved = moved and _differs(kind, seen, made)
        now = seen
    strength = (
        np.abs(now.strength - made.strength).max() > MIN_RELATIVE_CHANGE * made.strength.max()
    )
    softness = abs(now.softness - made.softness) > MIN_RELATIVE_CHANGE * max(
        now.softness, made.softness
    )
    return LampEdits(now, moved, bool(strength and lamp.get(INTENSITY_KNOWN)), bool(softness))


def changed_lights(
    capture: Capture, scene: bpy.types.Scene
) -> Iterator[tuple[LightEntry, bpy.types.Object]]:
    """(entry with the lamp's present values, lamp) of each light that the user has edited.

    Raises PatinaError if an edited lamp emits no light.
    """
    file = str(capture.file)
    origin = scan_origin(scene, file)
    for entry in capture.lights:
        lamp = lamp_of(scene, file, entry.name)
        if lamp is None or lamp.get(LAMP_KIND) != _kind(entry):
            continue
        hand = lamp_edits(scene, lamp)
        changed = entry if hand is None else _entry(entry, lamp, hand, origin)
        if changed is not entry:
            yield changed, lamp


def with_dragged_lamps(capture: Capture, scene: bpy.types.Scene) -> tuple[Capture, list[str]]:
    """(the capture with the lights as edited by the user, names of the edited lights).

    A moved lamp overrides the sphere, the sun or the coordinates of the capture file. Its strength
    overrides the irradiance or the white target, if the capture defines the strength. Lights whose
    lamps were not edited keep the values of the file. Raises PatinaError if an edited lamp emits no
    light.
    """
    changed = {entry.name: entry for entry, _ in changed_lights(capture, scene)}
    entries = tuple(changed.get(entry.name, entry) for entry in capture.lights)
    return replace(capture, lights=entries), list(changed)


def accept(capture: Capture, scene: bpy.types.Scene) -> None:
    """Record the present state of the lamps as that of the capture file, so that none counts as
    edited."""
    for entry in capture.lights:
        lamp = lamp_of(scene, str(capture.file), entry.name)
        hand = None if lamp is None else lamp_edits(scene, lamp)
        if hand:
            lamp[lamp_placement.LAMP_AS_IMPORTED] = hand.now.values
            if hand.moved:
                lamp[LIGHT_GUESS] = False
                error = (found_values(lamp, hand.now) or {}).get("standard_error")
                lamp.pop(STATED_ERROR, None)
                if error is not None:
                    lamp[STATED_ERROR] = error


def _differs(kind: str, now: Placement, made: Placement) -> bool:
    if kind == DISTANT:  # the position of a sun is arbitrary: only its direction counts
        return bool(np.linalg.norm(now.axis - made.axis) > MIN_ROTATION)
    rounding = MIN_TRANSLATION * max(np.abs(now.place).max(), np.abs(made.place).max())
    return bool(np.linalg.norm(now.place - made.place) > rounding)


def _kind(entry: LightEntry) -> str:
    if entry.distant:
        return DISTANT
    return NEAR if entry.mounted is None else MOUNTED


def _entry(entry: LightEntry, lamp: bpy.types.Object, hand: LampEdits, origin: Array) -> LightEntry:
    new: dict[str, Any] = {}
    strength = found_strength(lamp)
    if not (strength in (None, entry.relative_strength) or entry.strength_given):
        new["relative_strength"] = strength
    if hand.moved:
        new.update(guess=False, standard_error=None)
        new.update(found_values(lamp, hand.now) or {})
    if hand.moved and entry.mounted is not None:
        new["mounted"] = hand.now.place * FROM_CAMERA
    elif hand.moved and entry.position is not None:
        new["position"] = hand.now.place + origin
    elif hand.moved:
        new.update(direction=hand.now.axis, sphere=None, sun=None)
        if entry.sun is not None and entry.angle is None:  # the angle of the sun itself
            new["angle"] = hand.now.softness
    if hand.softness:
        new["angle" if entry.distant else "radius"] = hand.now.softness
    if hand.strength and entry.strength_given:
        if not (hand.now.strength > 0).all():
            raise PatinaError(
                f"Light {entry.name!r}: its lamp {lamp.name!r} emits no light in at least one of "
                "red, green and blue; set a strength and a colour above 0, or undo the edit"
            )
        new.update(strength=hand.now.strength, white=None)
    return replace(entry, **new) if new else entry


def mesh_frame(scene: bpy.types.Scene, capture: str | None) -> Array:
    """(4, 4) matrix_world of the capture's mesh; the identity if it was deleted or its scale is
    0."""
    for collection in collections_of(scene, capture):
        for thing in collection.objects:
            if thing.type == "MESH":
                frame = lamp_placement.world_matrix(thing)
                if abs(np.linalg.det(frame[:3, :3])) > 1e-18:
                    return frame
    return np.eye(4)
