"""The measured materials of this .blend."""

from __future__ import annotations

import bpy

from ..property_keys import CAPTURE, MEASURED_NAME


def measured_materials() -> list[bpy.types.Material]:
    """All materials that a fit created, sorted by name."""
    return sorted((m for m in bpy.data.materials if MEASURED_NAME in m), key=lambda m: m.name)


def measured_of(capture: str) -> dict[str, bpy.types.Material]:
    """Name in the capture → measured material, for one capture."""
    return {m[MEASURED_NAME]: m for m in measured_materials() if m.get(CAPTURE) == capture}
