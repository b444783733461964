"""The up axis of the scan, with the error of the axis that was found."""

from __future__ import annotations

import math

import bpy

from ..scene.scan.orientation import FOUND, found_up, scan_collections
from .wrapped import wrapped


def draw_orientation(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the choice of the up axis; nothing without a scan."""
    collections = scan_collections(scene)
    if not collections:
        return
    state = scene.patina_orientation
    layout.prop(state, "up_axis")
    if state.up_axis != FOUND:
        return
    found = found_up(collections[-1])
    if found is None or not found.reliable:
        wrapped(layout, "The cameras do not show what is up; choose the up axis", "INFO")
    else:
        error = math.degrees(found.standard_error)
        wrapped(layout, f"Up found from the cameras, ± {max(error, 0.1):.1f}°", "BLANK1")
