"""A photo brighter or darker, for looking only: Blender's viewport shows images by no exposure of
the scene's."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.photo.transfer import SRGB
from ...core.views import display
from ..property_keys import EXPOSED_PHOTO
from ..session.session_state import Kept

NAME = "Patina: exposed photo"
LONGEST = 1280  # pixels: it follows a slider

_last: Kept[tuple[str, NDArray[np.float32]]] = Kept()  # name of the photo, its light


def exposed(photo: bpy.types.Image, stops: float) -> bpy.types.Image:
    """The photo itself at 0 stops, else an image that shows it so much brighter."""
    if not stops:
        return photo
    light = _light(photo)
    height, width, _ = light.shape
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = display.srgb(light * np.float32(2.0**stops)) / np.float32(255)
    image = next((i for i in bpy.data.images if EXPOSED_PHOTO in i and i.library is None), None)
    if image is None:
        image = bpy.data.images.new(NAME, width, height)
        image[EXPOSED_PHOTO] = True
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()  # or Blender would ask to save it, and a reload would lose it
    return image


def _light(photo: bpy.types.Image) -> NDArray[np.float32]:
    """(h, w, 3) linear, upside down as Blender has it, small; of the last photo it is kept."""
    if _last.thing is None or _last.thing[0] != photo.name:
        width, height = photo.size
        pixels = np.empty(width * height * 4, np.float32)
        photo.pixels.foreach_get(pixels)
        small = display.shrink(pixels.reshape(height, width, 4)[..., :3], LONGEST)
        if not photo.is_float:  # bytes are as the file has them
            small = SRGB(small)
        _last.thing = photo.name, small.astype(np.float32)
    return _last.thing[1]
