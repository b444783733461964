"""Buttons that show on the mesh how its materials vary."""

from __future__ import annotations

import bpy

from ..operators.variation import LABELS
from ..scene.property_keys import VARIATION_COLOURS
from ..scene.scan.variation_colours import painted_kinds
from ..scene.session.overlay_shading import overlay_shown

COLUMNS = 2


def draw_variation(layout: bpy.types.UILayout, mesh: bpy.types.Object | None) -> None:
    """Draw one button for each quantity that varies; nothing where all materials are even."""
    kinds = painted_kinds(mesh)
    if not kinds:
        return
    layout.label(text="Variation on the Mesh:")
    grid = layout.grid_flow(columns=COLUMNS, even_columns=True, align=True, row_major=True)
    shown = overlay_shown()
    for kind in kinds:
        grid.operator(
            "patina.show_variation",
            text=LABELS[kind],
            icon="OVERLAY",
            depress=shown == VARIATION_COLOURS + kind,
        ).kind = kind
