"""Entries in Blender's File ▸ Import menu, which F3 also finds."""

from __future__ import annotations

import bpy


def _draw(menu: bpy.types.Menu, context: bpy.types.Context) -> None:
    layout = menu.layout
    layout.operator("patina.import_capture", text="Patina Capture (.capture.toml)")
    layout.operator("patina.add_files", text="Patina: New Capture from Files")
    layout.operator("patina.import_demo", text="Patina: Demo Capture")


def register() -> None:
    """Append the entries."""
    bpy.types.TOPBAR_MT_file_import.append(_draw)


def unregister() -> None:
    """Remove the entries."""
    bpy.types.TOPBAR_MT_file_import.remove(_draw)
