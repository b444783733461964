"""Pictures that Patina makes, as images that an Image Editor shows."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.views.drawing import Drawing
from ...core.views.raster import raster
from ..property_keys import VIEW_KIND
from ..session.image_editor import width_to_show

USUAL, LEAST, MOST = 2.0, 1.0, 3.0  # pixels to one of the drawing's


def put_view(context: bpy.types.Context, kind: str, drawing: Drawing) -> bpy.types.Image:
    """Show a drawing as the image of that view, as large as the editor is wide; it stays in the
    .blend."""
    across = width_to_show(context)
    scale = USUAL if across is None else min(max(0.96 * across / drawing.width, LEAST), MOST)
    pixels = raster(drawing, scale)
    height, width, _ = pixels.shape
    image = view_image(kind)
    if image is None:
        image = bpy.data.images.new(f"Patina: {kind}", width, height)
        image[VIEW_KIND] = kind
        image.use_fake_user = True  # editors that show it are no users that a file counts
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels[::-1] / np.float32(255)  # Blender's rows go up
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()  # or Blender would ask to save it, and a reload would lose it
    return image


def view_image(kind: str) -> bpy.types.Image | None:
    """That of a view where it was shown before."""
    mine = (i for i in bpy.data.images if i.get(VIEW_KIND) == kind and i.library is None)
    return next(mine, None)
