"""Lights where a diagnosis found them: the directions and places of its named causes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..angles.vectors import tangents
from ..inputs.lights import Lights
from ..light import DistantLight, MountedLight

Effects = Mapping[str, Mapping[str, float]]
"""Cause → name of a parameter ("light, way") → its value, as the diagnosis states them."""

APPLIED = ("light_direction", "flash_offset")  # causes that place a light exactly


def displaced_lights(lights: Lights, effects: Effects) -> Lights:
    """The lights of a capture, displaced by the effects in APPLIED. Others are ignored."""
    found = dict(lights.by_name)
    for name, light in lights.by_name.items():
        if isinstance(light, DistantLight) and "light_direction" in effects:
            ways = _of_light(effects["light_direction"], name, ("first", "second"))
            axes = [axis[0] for axis in tangents(light.direction[None])]
            direction = light.direction + ways[0] * axes[0] + ways[1] * axes[1]
            found[name] = replace(light, direction=direction / np.linalg.norm(direction))
        if isinstance(light, MountedLight) and "flash_offset" in effects:
            ways = _of_light(effects["flash_offset"], name, ("right", "down", "forward"))
            found[name] = replace(light, offset=light.offset + ways)
    return replace(lights, by_name=found)


def not_applied(effects: Effects) -> tuple[str, ...]:
    """The causes that displaced_lights ignores."""
    return tuple(cause for cause in effects if cause not in APPLIED)


def _of_light(parameters: Mapping[str, float], light: str, ways: tuple[str, ...]) -> np.ndarray:
    """The parameters of one light, 0 where the diagnosis states none."""
    return np.array([parameters.get(f"{light}, {way}", 0.0) for way in ways])
