"""A sentence in a sidebar."""

from __future__ import annotations

import textwrap

import bpy

USUAL = 36  # letters across


def wrapped(layout: bpy.types.UILayout, text: str, icon: str) -> None:
    """Over as many lines as the sidebar's usual width needs."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for i, line in enumerate(textwrap.wrap(text, USUAL)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")
