"""A sentence in a sidebar."""

from __future__ import annotations

import textwrap

import bpy

USUAL = 36  # letters across
IN_BOX = 33


def wrapped(layout: bpy.types.UILayout, text: str, icon: str, width: int = USUAL) -> None:
    """Over as many lines as the sidebar's usual width needs; width: letters across."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for i, line in enumerate(textwrap.wrap(text, width)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")
