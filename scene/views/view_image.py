"""Drawings of Patina as images in an Image Editor."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.views.drawing import Drawing
from ...core.views.raster import raster
from ..property_keys import VIEW_KIND
from ..session.image_editor import width_to_show

DEFAULT_SCALE, MIN_SCALE, MAX_SCALE = 2.0, 1.0, 3.0  # image pixels per unit of the drawing


def put_view(context: bpy.types.Context, kind: str, drawing: Drawing) -> bpy.types.Image:
    """Draw into the image of a view, in the width of the editor. The image is stored in the
    .blend."""
    across = width_to_show(context)
    scale = (
        DEFAULT_SCALE
        if across is None
        else min(max(0.96 * across / drawing.width, MIN_SCALE), MAX_SCALE)
    )
    pixels = raster(drawing, scale)
    height, width, _ = pixels.shape
    image = view_image(kind)
    if image is None:
        image = bpy.data.images.new(f"Patina: {kind}", width, height)
        image[VIEW_KIND] = kind
        image.use_fake_user = True  # an editor that shows an image does not count as its user
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels[::-1] / np.float32(255)  # Blender stores the bottom row first
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()  # otherwise Blender asks to save it, and a reload loses it
    return image


def view_image(kind: str) -> bpy.types.Image | None:
    """The image of a view; None if the view was not drawn yet."""
    images = (i for i in bpy.data.images if i.get(VIEW_KIND) == kind and i.library is None)
    return next(images, None)
