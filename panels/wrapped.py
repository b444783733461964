"""Draw a sentence in the sidebar, wrapped over several lines."""

from __future__ import annotations

import textwrap

import bpy

SIDEBAR_WIDTH = 36  # characters per line at the sidebar's default width
IN_BOX = 33  # characters per line inside a box


def wrapped(layout: bpy.types.UILayout, text: str, icon: str, width: int = SIDEBAR_WIDTH) -> None:
    """Draw ``text`` as labels of at most ``width`` characters each; the icon is on the first."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for i, line in enumerate(textwrap.wrap(text, width)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")
