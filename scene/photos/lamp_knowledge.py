"""How well a lamp of a capture is known: measured, found from photos, placed by hand or a guess."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import bpy

from ..property_keys import INTENSITY_KNOWN, LAMP_KIND, LIGHT_GUESS, LIGHT_NAME, STATED_ERROR
from ..session.lengths import length
from .dragged_lamps import lamp_edits, lamp_of
from .found_lights import found_values
from .lamp_placement import DISTANT


class Source(Enum):
    """Where the direction or position of a lamp comes from."""

    CAPTURE = "from the capture file"
    FOUND = "found from photos"
    BY_HAND = "placed by hand"
    GUESS = "a guess"
    MISSING = "not in the scene"


@dataclass(frozen=True)
class LampKnowledge:
    """name: of the light; error: standard error, radians of a direction or scan units; strength:
    whether its irradiance or intensity is known."""

    name: str
    source: Source
    error: float | None = None
    distant: bool = True
    strength: bool = False

    @property
    def sentence(self) -> str:
        """For the panel."""
        if self.error is None:
            return f"{self.name}: {self.source.value}"
        spread = f"{math.degrees(self.error):.1f}°" if self.distant else length(self.error)
        return f"{self.name}: {self.source.value}, ± {spread}"


def lamp_knowledge(scene: bpy.types.Scene, lamp: bpy.types.Object) -> LampKnowledge:
    """What is known of a lamp as it is now."""
    known = _placement_knowledge(scene, lamp)
    return replace(known, strength=bool(lamp.get(INTENSITY_KNOWN)))


def _placement_knowledge(scene: bpy.types.Scene, lamp: bpy.types.Object) -> LampKnowledge:
    name, distant = lamp.get(LIGHT_NAME, lamp.name), lamp.get(LAMP_KIND) == DISTANT
    edits = lamp_edits(scene, lamp)
    if edits is not None and edits.moved:
        found = found_values(lamp, edits.now)
        if found is None:
            return LampKnowledge(name, Source.BY_HAND)
        return LampKnowledge(name, Source.FOUND, found["standard_error"], distant)
    if lamp.get(LIGHT_GUESS):
        return LampKnowledge(name, Source.GUESS)
    error = lamp.get(STATED_ERROR)
    return LampKnowledge(name, Source.CAPTURE if error is None else Source.FOUND, error, distant)


def knowledge_of(scene: bpy.types.Scene, capture: str, light: str) -> LampKnowledge:
    """What is known of a light of a capture."""
    lamp = lamp_of(scene, capture, light)
    return LampKnowledge(light, Source.MISSING) if lamp is None else lamp_knowledge(scene, lamp)
