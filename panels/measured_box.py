"""A summary of each fitted material: preview, prediction error, uncertainty, coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy

from ..core.fit.fit_quality import FitQuality, Rating
from ..core.report.figures import either_side
from ..core.varying.varying_surface import EVEN
from .wrapped import IN_BOX, wrapped

SPHERE = 5.0  # scale of the preview icon, in line heights
LIGHT_MAY_BE_WRONG = "black where the light should reach"  # in a warning of fit_warnings.py
MAX_COEFFICIENTS = 8  # coefficients that are listed for each channel


def draw_measured(
    layout: bpy.types.UILayout,
    result: dict[str, Any] | None,
    materials: Mapping[str, bpy.types.Material],
) -> None:
    """Draw the fitted materials.

    result: the content of result.json; materials: name in it → Blender material.
    """
    varying = (result or {}).get("varying")
    kinds = {entry["name"]: entry["varies"] for entry in (varying or {}).get("materials", [])}
    for material in (result or {}).get("materials", []):
        box = layout.box()
        box.label(text=material["name"], icon="MATERIAL")
        quality = FitQuality.of_result(material, varying)
        icon = "ERROR" if quality.rating is Rating.POOR else "BLANK1"
        wrapped(box, quality.sentence, icon, IN_BOX)
        if material["name"] in materials:
            box.template_icon(icon_value=icon_of(materials[material["name"]]), scale=SPHERE)
        if "interval_90" in material["uncertainty"]:
            median = either_side(material["uncertainty"]["median"])
            interval = f"90 % interval of the BRDF: {median} (median over directions)"
            wrapped(box, interval, "BLANK1", IN_BOX)
        box.label(text=f"{material['samples']['used']:,} samples", icon="BLANK1")
        if kinds.get(material["name"], EVEN) != EVEN:
            wrapped(box, f"Varies over the surface: {kinds[material['name']]}", "BLANK1", IN_BOX)
        for warning in material["warnings"]:
            wrapped(box, warning, "ERROR", IN_BOX)
            if LIGHT_MAY_BE_WRONG in warning:
                box.operator("patina.find_lights")
        _coefficients(layout, material)
    photo = (result or {}).get("proposed_photo")
    if photo is not None:
        box = layout.box()
        box.label(text="Proposed Photo", icon="CAMERA_DATA")
        wrapped(box, photo["sentence"], "BLANK1", IN_BOX)
        box.operator("patina.show_proposed_photo", icon="HIDE_OFF")


def _coefficients(layout: bpy.types.UILayout, material: dict[str, Any]) -> None:
    """A collapsed panel with the first coefficients, those that Change Traits edits."""
    header, body = layout.panel(f"patina_coefficients_{material['name']}", default_closed=True)
    header.label(text="Coefficients")
    if body is None:
        return
    rows = material["coefficients"]
    grid = body.grid_flow(columns=4, even_columns=True, row_major=True, align=True)
    for word in ("", "R", "G", "B"):
        grid.label(text=word)
    for index in range(min(MAX_COEFFICIENTS, len(rows[0]))):
        grid.label(text=f"{index + 1}")
        for channel in rows:
            grid.label(text=f"{channel[index]:+.3f}")
    if len(rows[0]) > MAX_COEFFICIENTS:
        body.label(text=f"All {len(rows[0])} in result.json", icon="BLANK1")


def icon_of(material: bpy.types.Material) -> int:
    """The icon number of the material's preview; 0 (no icon) if it has none."""
    return material.preview.icon_id if material.preview is not None else 0
