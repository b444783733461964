"""What a fit found of every material, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy

from ..core.report.figures import either_side
from .wrapped import IN_BOX, wrapped

SPHERE = 5.0  # of a line's height
SHOWN = 8  # coefficients


def draw_measured(
    layout: bpy.types.UILayout,
    result: dict[str, Any] | None,
    there: Mapping[str, bpy.types.Material],
) -> None:
    """result: the content of result.json; there: name in it → material."""
    for material in (result or {}).get("materials", []):
        box = layout.box()
        box.label(text=material["name"], icon="MATERIAL")
        if material["name"] in there:
            box.template_icon(icon_value=icon_of(there[material["name"]]), scale=SPHERE)
        held = material.get("held_out")
        if held:
            said = f"Predicts a photo it has not seen to {100 * held['typical']:.0f} %"
            wrapped(box, said, "BLANK1", IN_BOX)
        if "interval_90" in material["uncertainty"]:
            known = either_side(material["uncertainty"]["median"])
            wrapped(box, f"BRDF: {known} in half of directions", "BLANK1", IN_BOX)
        box.label(text=f"{material['samples']['used']:,} samples", icon="BLANK1")
        for warning in material["warnings"]:
            wrapped(box, warning, "ERROR", IN_BOX)
        _coefficients(layout, material)


def _coefficients(layout: bpy.types.UILayout, material: dict[str, Any]) -> None:
    """Of the first components, folded: what Change Traits moves."""
    header, body = layout.panel(f"patina_coefficients_{material['name']}", default_closed=True)
    header.label(text="Coefficients")
    if body is None:
        return
    rows = material["coefficients"]
    grid = body.grid_flow(columns=4, even_columns=True, row_major=True, align=True)
    for word in ("", "R", "G", "B"):
        grid.label(text=word)
    for number in range(min(SHOWN, len(rows[0]))):
        grid.label(text=f"{number + 1}")
        for channel in rows:
            grid.label(text=f"{channel[number]:+.3f}")
    if len(rows[0]) > SHOWN:
        body.label(text=f"{len(rows[0])} in result.json", icon="BLANK1")


def icon_of(material: bpy.types.Material) -> int:
    """Of its preview, the usual one where it has none."""
    return material.preview.icon_id if material.preview is not None else 0
