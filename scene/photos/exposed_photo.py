"""Show a photo brighter or darker. Blender's viewport does not apply the scene's exposure to
background images, so a scaled copy is shown."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.photo.transfer import SRGB
from ...core.views import display
from ..property_keys import EXPOSED_PHOTO
from ..session.session_state import KeptValue

NAME = "Patina: exposed photo"
MAX_SIDE = 1280  # longest side of the copy, pixels; reduced so that it can follow a slider

_last: KeptValue[tuple[str, NDArray[np.float32]]] = (
    KeptValue()
)  # name of the photo, its linear pixels


def exposed(photo: bpy.types.Image, stops: float) -> bpy.types.Image:
    """The photo itself at 0 stops, else a copy that is brighter by ``stops``."""
    if not stops:
        return photo
    linear = _linear_pixels(photo)
    height, width, _ = linear.shape
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = display.srgb(linear * np.float32(2.0**stops)) / np.float32(255)
    image = next((i for i in bpy.data.images if EXPOSED_PHOTO in i and i.library is None), None)
    if image is None:
        image = bpy.data.images.new(NAME, width, height)
        image[EXPOSED_PHOTO] = True
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()  # otherwise Blender asks to save it, and a reload loses it
    return image


def _linear_pixels(photo: bpy.types.Image) -> NDArray[np.float32]:
    """(h, w, 3) linear pixels of the photo, reduced, in Blender's row order (bottom row first).
    Those of the last photo are cached."""
    if _last.value is None or _last.value[0] != photo.name:
        width, height = photo.size
        pixels = np.empty(width * height * 4, np.float32)
        photo.pixels.foreach_get(pixels)
        small = display.shrink(pixels.reshape(height, width, 4)[..., :3], MAX_SIDE)
        if not photo.is_float:  # 8-bit pixels are sRGB-encoded
            small = SRGB(small)
        _last.value = photo.name, small.astype(np.float32)
    return _last.value[1]
