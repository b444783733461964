"""Icons of plain colours for buttons."""

from __future__ import annotations

import bpy
import bpy.utils.previews
import numpy as np

SIDE = 16  # pixels

_icons: bpy.utils.previews.ImagePreviewCollection | None = None


def swatch(colour: tuple[int, int, int]) -> int:
    """Icon number for an 8-bit sRGB colour."""
    global _icons
    if _icons is None:
        _icons = bpy.utils.previews.new()
    name = "{:02x}{:02x}{:02x}".format(*colour)
    if name not in _icons:
        icon = _icons.new(name)
        icon.icon_size = (SIDE, SIDE)
        pixels = np.ones((SIDE, SIDE, 4), np.float32)
        pixels[..., :3] = np.array(colour) / 255
        icon.icon_pixels_float = pixels.ravel()
    return int(_icons[name].icon_id)


def register() -> None:
    """Nothing to register: icons are created on first use."""


def unregister() -> None:
    """Remove all icons."""
    global _icons
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
        _icons = None
