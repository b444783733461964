"""Small squares of colour for buttons."""

from __future__ import annotations

import bpy
import bpy.utils.previews
import numpy as np

SIDE = 16

_made: bpy.utils.previews.ImagePreviewCollection | None = None


def swatch(colour: tuple[int, int, int]) -> int:
    """Number of the icon of an 8-bit sRGB colour."""
    global _made
    if _made is None:
        _made = bpy.utils.previews.new()
    name = "{:02x}{:02x}{:02x}".format(*colour)
    if name not in _made:
        made = _made.new(name)
        made.icon_size = (SIDE, SIDE)
        pixels = np.ones((SIDE, SIDE, 4), np.float32)
        pixels[..., :3] = np.array(colour) / 255
        made.icon_pixels_float = pixels.ravel()
    return int(_made[name].icon_id)


def register() -> None:
    """They are made when they are asked for."""


def unregister() -> None:
    """All icons go."""
    global _made
    if _made is not None:
        bpy.utils.previews.remove(_made)
        _made = None
