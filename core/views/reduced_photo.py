"""A lit photo in fewer pixels, with its camera, masks and margins, for pictures of its size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene, bands
from ..inputs.photos import LitPhoto
from ..samples import Margins
from ..scan import Camera
from ..scan.lens import resized_parameters


def reduction(camera: Camera, rays: RayScene, side: int) -> int:
    """The whole number by which a photo is reduced for a picture whose longest side is at most
    ``side`` pixels: its pixels are then means of at least two by two predicted ones."""
    windows = list(bands(camera, 0, rays.cover.columns(camera)))
    longest = max(camera.width, camera.height)
    if windows:
        width = max(w.right for w in windows) - min(w.left for w in windows)
        height = max(w.last for w in windows) - min(w.first for w in windows)
        longest = max(width, height)
    return max(1, -(-longest // side) // 2)


def reduced_camera(camera: Camera, factor: int) -> Camera:
    """The camera of the photo whose pixels are the means of factor × factor pixels. Rows and
    columns at the end that make no whole pixel are left out."""
    width, height = camera.width // factor, camera.height // factor
    used = factor * width, factor * height
    parameters = resized_parameters(camera.model, camera.parameters, used, (width, height))
    return replace(camera, width=width, height=height, parameters=parameters)


def reduced_photo(photo: LitPhoto, factor: int) -> LitPhoto:
    """The photo with the means of factor × factor pixels; usable where all of them are."""
    if factor == 1:
        return photo
    radiance = np.add.reduce(_parts(photo.radiance, factor), dtype=np.float32)
    usable = np.logical_and.reduce(_parts(photo.usable, factor))
    return replace(photo, radiance=radiance / np.float32(factor**2), usable=usable, noise=None)


def reduced_masks(
    masks: Mapping[str, NDArray[np.bool_]], factor: int
) -> dict[str, NDArray[np.bool_]]:
    """Masks that mark a pixel where they mark most of its factor × factor pixels."""
    if factor == 1:
        return dict(masks)
    return {
        name: np.add.reduce(_parts(mask.astype(np.uint16), factor)) * 2 > factor**2
        for name, mask in masks.items()
    }


def reduced_margins(margins: Margins, factor: int) -> Margins:
    """The margins in pixels of the reduced photo, rounded up."""

    def fewer(pixels: int) -> int:
        return -(-pixels // factor)

    return Margins(
        fewer(margins.silhouette), fewer(margins.shadow), fewer(margins.mask), margins.cosine
    )


def _parts(values: NDArray, factor: int) -> list[NDArray]:
    """The first, second … of each group of factor × factor pixels, (h, w, …) each."""
    height, width = (size // factor for size in values.shape[:2])
    whole = values[: height * factor, : width * factor]
    return [whole[row::factor, column::factor] for row in range(factor) for column in range(factor)]
