"""The material of each pixel of a photo, as an image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..geometry import RayScene, view_surface
from ..scan import Camera, Scan
from . import capture_data
from .material_pixels import material_pixels


def material_image(
    capture: Capture, scan: Scan, rays: RayScene, camera: Camera, place: int
) -> NDArray[np.int16]:
    """(h, w) index of each pixel's material, −1 in masked shadow and where there is none.

    place: index of the photo. Without masks and faces every pixel belongs to the only material,
    also those that do not show the mesh.
    """
    shape = camera.height, camera.width
    only = capture.materials[0]
    whole = not (only.by_mesh or capture.named_by_masks(only.name) or capture.photos[place].masks)
    if whole and len(capture.materials) == 1:
        return np.zeros(shape, np.int16)
    view = view_surface(rays, camera)
    where, shadow = material_pixels(capture, scan, view, capture_data.photo_masks(capture, place))
    found = np.full(shape[0] * shape[1], -1, np.int16)
    for index, material in enumerate(capture.materials):
        found[view.pixel[where[material.name] & ~shadow]] = index
    return found.reshape(shape)
