"""What the artist has changed on a capture's lamps, and the capture as they stand now."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture import Capture, LightEntry
from ...core.errors import PatinaError
from ..property_keys import CAPTURE, INTENSITY_KNOWN, LAMP_KIND, LIGHT_NAME, ORIGIN
from . import lamp_placement
from .lamp_placement import DISTANT, FROM_CAMERA, MOUNTED, NEAR, Stand

Array = NDArray[np.float64]

# less than this is the rounding of Blender's float32
TURNED = 1e-4  # radians
PLACED = 4e-6  # of the largest coordinate
RELATIVE = 1e-5  # of a strength or a size
LAMP_TYPE = {DISTANT: "SUN", NEAR: "POINT", MOUNTED: "POINT"}


@dataclass(frozen=True)
class ByHand:
    """What of a lamp is no longer as it was made. now: how it stands, in the mesh's frame."""

    now: Stand
    moved: bool
    strength: bool
    softness: bool

    def __bool__(self) -> bool:
        return self.moved or self.strength or self.softness


def lamp_of(scene: bpy.types.Scene, capture: str, light: str) -> bpy.types.Object | None:
    """The lamp of a capture's light in a scene; of copies the one with the light's own name, else
    the first by name."""
    found = [
        o
        for o in scene.objects
        if o.type == "LIGHT" and o.get(CAPTURE) == capture and o.get(LIGHT_NAME) == light
    ]
    return min(found, key=lambda o: (o.name != light, o.name), default=None)


def by_hand(scene: bpy.types.Scene, lamp: bpy.types.Object) -> ByHand | None:
    """What the artist has changed; None where the lamp is no longer what was made of the light.

    A lamp that is where it was, in the world or as the mesh sees it (the artist may turn or scale
    the whole scan upright with its lamps), has not been moved.
    """
    made, kind = lamp_placement.made_stand(lamp), lamp.get(LAMP_KIND)
    if made is None or LAMP_TYPE.get(kind) != lamp.data.type:
        return None
    now = lamp_placement.stand(lamp, scene)
    if not all(np.isfinite(now.numbers)) or np.linalg.norm(now.axis) < 0.5:  # scaled to nothing
        return None
    moved = _apart(kind, now, made)
    if kind != MOUNTED:
        seen = now.within(_mesh_frame(scene, lamp.get(CAPTURE)))
        moved = moved and _apart(kind, seen, made)
        now = seen
    strength = np.abs(now.strength - made.strength).max() > RELATIVE * made.strength.max()
    softness = abs(now.softness - made.softness) > RELATIVE * max(now.softness, made.softness)
    return ByHand(now, moved, bool(strength and lamp.get(INTENSITY_KNOWN)), bool(softness))


def changed_lights(
    capture: Capture, scene: bpy.types.Scene
) -> Iterator[tuple[LightEntry, bpy.types.Object]]:
    """(entry as its lamp stands, lamp) of the lights that the artist has changed.

    Raises PatinaError where a lamp no longer shines.
    """
    file = str(capture.file)
    origin = np.zeros(3)
    for collection in _collections(scene, file):
        origin = np.array(collection.get(ORIGIN, (0.0, 0.0, 0.0)), np.float64)
    for entry in capture.lights:
        lamp = lamp_of(scene, file, entry.name)
        if lamp is None or lamp.get(LAMP_KIND) != _kind(entry):
            continue
        hand = by_hand(scene, lamp)
        if hand:
            changed = _entry(entry, lamp, hand, origin)
            if changed is not entry:
                yield changed, lamp


def with_dragged_lamps(capture: Capture, scene: bpy.types.Scene) -> tuple[Capture, list[str]]:
    """(the capture with its lights as the artist has left their lamps, names of those changed).

    A dragged lamp overrides the sphere, the sun or the numbers of the capture file, its strength
    (where the capture's is known at all) the irradiance or the white target; the lights of lamps
    that nobody has touched stay as read. Raises PatinaError where a lamp no longer shines.
    """
    changed = {entry.name: entry for entry, _ in changed_lights(capture, scene)}
    entries = tuple(changed.get(entry.name, entry) for entry in capture.lights)
    return replace(capture, lights=entries), list(changed)


def accept(capture: Capture, scene: bpy.types.Scene) -> None:
    """What the lamps are now is what the capture's file says: nothing counts as changed."""
    for entry in capture.lights:
        lamp = lamp_of(scene, str(capture.file), entry.name)
        hand = None if lamp is None else by_hand(scene, lamp)
        if hand:
            lamp[lamp_placement.LAMP_AS_IMPORTED] = hand.now.numbers


def _apart(kind: str, now: Stand, made: Stand) -> bool:
    if kind == DISTANT:  # a sun may be moved about: only its direction counts
        return bool(np.linalg.norm(now.axis - made.axis) > TURNED)
    rounding = PLACED * max(np.abs(now.place).max(), np.abs(made.place).max())
    return bool(np.linalg.norm(now.place - made.place) > rounding)


def _kind(entry: LightEntry) -> str:
    if entry.distant:
        return DISTANT
    return NEAR if entry.mounted is None else MOUNTED


def _entry(entry: LightEntry, lamp: bpy.types.Object, hand: ByHand, origin: Array) -> LightEntry:
    new: dict[str, Any] = {}
    if hand.moved and entry.mounted is not None:
        new["mounted"] = hand.now.place * FROM_CAMERA
    elif hand.moved and entry.position is not None:
        new["position"] = hand.now.place + origin
    elif hand.moved:
        new.update(direction=hand.now.axis, sphere=None, sun=None)
        if entry.sun is not None and entry.angle is None:  # the sun's own
            new["angle"] = hand.now.softness
    if hand.softness:
        new["angle" if entry.distant else "radius"] = hand.now.softness
    if hand.strength and entry.strength_given:
        if not (hand.now.strength > 0).all():
            raise PatinaError(
                f"light {entry.name!r}: its lamp {lamp.name!r} gives no light in one of red, green "
                "and blue; give it a strength and a colour, or undo"
            )
        new.update(strength=hand.now.strength, white=None)
    return replace(entry, **new) if new else entry


def _mesh_frame(scene: bpy.types.Scene, capture: str | None) -> Array:
    """(4, 4) the mesh's matrix_world, the identity where it is gone or scaled to nothing."""
    for collection in _collections(scene, capture):
        for thing in collection.objects:
            if thing.type == "MESH":
                frame = lamp_placement.world_matrix(thing)
                if abs(np.linalg.det(frame[:3, :3])) > 1e-18:
                    return frame
    return np.eye(4)


def _collections(scene: bpy.types.Scene, capture: str | None) -> Iterator[bpy.types.Collection]:
    for collection in scene.collection.children_recursive:
        if capture is not None and collection.get(CAPTURE) == capture:
            yield collection
