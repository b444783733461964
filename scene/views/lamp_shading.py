"""Shade a 3D viewport with the lamp of the photo in view, to compare shading and shadows with the
photo while the lamp is moved."""

from __future__ import annotations

import json

import bpy

from ..property_keys import LAMP_SHADING

SETTINGS = ("type", "use_scene_lights", "use_scene_world")
WITH_LAMP = ("MATERIAL", True, True)  # values of these: EEVEE with the scene's lamps and world


def lamp_shading(area: bpy.types.Area) -> bool:
    """Whether a viewport is shaded with the lamps of the scene."""
    return _settings(area.spaces.active.shading) == WITH_LAMP


def toggle_lamp_shading(screen: bpy.types.Screen, area: bpy.types.Area) -> bool:
    """Shade a viewport with the lamps, or restore the shading before. Returns whether it is shaded
    with the lamps now."""
    shading = area.spaces.active.shading
    stored = _stored(screen)
    key = str(area.as_pointer())
    if lamp_shading(area):
        before = stored.pop(key, ["SOLID", False, False])
        shading.use_scene_lights, shading.use_scene_world = before[1], before[2]
        shading.type = before[0]
    else:
        stored[key] = list(_settings(shading))
        shading.type = WITH_LAMP[0]
        shading.use_scene_lights, shading.use_scene_world = WITH_LAMP[1:]
    screen[LAMP_SHADING] = json.dumps(stored)
    return lamp_shading(area)


def _settings(shading: bpy.types.View3DShading) -> tuple[str, bool, bool]:
    return tuple(getattr(shading, name) for name in SETTINGS)  # type: ignore[return-value]


def _stored(screen: bpy.types.Screen) -> dict[str, list]:  # type: ignore[type-arg]
    """Viewport → its earlier settings."""
    try:
        found = json.loads(screen.get(LAMP_SHADING, "{}"))
        return {
            k: v for k, v in found.items() if v[0] in ("WIREFRAME", "SOLID", "MATERIAL", "RENDERED")
        }
    except (ValueError, TypeError, AttributeError, IndexError, KeyError):
        return {}
