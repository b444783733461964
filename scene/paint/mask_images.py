"""Masks of photos as Blender images. They can be painted on, are packed into the .blend, and are
read by the next fit."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture import Capture
from ...core.capture.model import EXCLUDED_MASKS, SHADOW_MASK
from ...core.errors import PatinaError
from ...core.photo.image import write_png
from ..property_keys import CAPTURE, LIT_PHOTO_INDEX, MASK_KIND, MASK_PHOTO_INDEX, MASK_PHOTO_NAME
from ..session.folders import blend_folder
from ..session.handlers import register_handlers_factory

KIND_LABELS = {"shadow": "Shadow", "highlight": "Highlight", "ignore": "Ignore"}


def masks_folder(capture: Path) -> Path:
    """Folder for the masks of one capture; the path has a hash because names may be equal."""
    digest = hashlib.sha256(str(capture.resolve()).encode()).hexdigest()[:8]
    return blend_folder() / "masks" / f"{capture.name.split('.')[0]}-{digest}"


def mask_images(capture: str) -> dict[tuple[int, str], bpy.types.Image]:
    """(index of the photo, kind: one of EXCLUDED_MASKS) → its mask image in this .blend."""
    return {
        (int(image[MASK_PHOTO_INDEX]), str(image.get(MASK_KIND, SHADOW_MASK))): image
        for image in bpy.data.images
        if image.get(CAPTURE) == capture
        and isinstance(image.get(MASK_PHOTO_INDEX), int)
        and image.get(MASK_KIND, SHADOW_MASK)
        in EXCLUDED_MASKS  # checked because it becomes part of file names
    }


def shadow_images(capture: str) -> dict[int, bpy.types.Image]:
    """Index of the photo → its shadow mask in this .blend."""
    return {
        place: image for (place, kind), image in mask_images(capture).items() if kind == SHADOW_MASK
    }


def show_shadow_masks(
    scene: bpy.types.Scene, capture: str, names: Sequence[str], files: Sequence[Path]
) -> None:
    """Load one shadow mask per photo. An open Image Editor shows the mask of the scene's camera.

    names: of the photos; files: of their masks.
    """
    masks = shadow_images(capture)
    for place, file in enumerate(files):
        image = masks.get(place)
        if image is None:
            image = bpy.data.images.load(str(file))
            masks[place] = image
        else:
            image.filepath = str(file)
            if image.packed_file is not None:
                image.unpack(method="REMOVE")
            image.reload()
        _mark(image, capture, place, names[place], SHADOW_MASK)
        image.pack()
    camera = scene.camera
    shown = masks.get(camera.get(LIT_PHOTO_INDEX, 0) if camera is not None else 0)
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = shown


def read_mask_image(image: bpy.types.Image) -> NDArray[np.bool_]:
    """(h, w) Boolean mask, first row at the top: True for white pixels."""
    return read_pixels(image)[..., 0] > 127


def store_mask(
    capture: str, place: int, name: str, kind: str, grey: NDArray[np.uint8]
) -> bpy.types.Image:
    """Store a mask (h, w) of one photo as a packed image; an existing image is overwritten."""
    image = mask_images(capture).get((place, kind))
    height, width = grey.shape
    if image is None:
        image = bpy.data.images.new(f"{KIND_LABELS[kind]}: {name}", width, height)
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    _mark(image, capture, place, name, kind)
    write_pixels(image, np.repeat(grey[..., None], 3, axis=2))
    image.pack()
    return image


def read_pixels(image: bpy.types.Image) -> NDArray[np.uint8]:
    """(h, w, 3) pixels of an 8-bit image, first row at the top."""
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    rows = pixels.reshape(height, width, image.channels)[::-1, :, : min(image.channels, 3)]
    out = np.round(255 * np.clip(rows, 0, 1)).astype(np.uint8)
    return out if out.shape[2] == 3 else np.repeat(out[..., :1], 3, axis=2)


def write_pixels(image: bpy.types.Image, pixels: NDArray[np.uint8]) -> None:
    """Write pixels (h, w, 3), first row at the top, into an 8-bit image of that size."""
    out = np.ones((*pixels.shape[:2], image.channels), np.float32)
    count = min(image.channels, 3)
    out[..., :count] = pixels[::-1, :, :count] / np.float32(255)
    image.pixels.foreach_set(out.ravel())
    image.update()


def with_mask_images(capture: Capture) -> Capture:
    """The capture with the masks of this .blend added; they replace masks of the same photo and
    kind. A photo whose index has changed is found by its name.

    Raises PatinaError if a mask cannot be written to a file for the fit.
    """
    images = mask_images(str(capture.file))
    if not images:
        return capture
    names = [photo.file.name for photo in capture.photos]
    masks = [dict(photo.masks) for photo in capture.photos]
    for (old, kind), image in images.items():
        place = old
        name = image.get(MASK_PHOTO_NAME)
        if name is not None and not (old < len(names) and names[old] == name):
            if name not in names:
                continue  # the capture no longer has this photo
            place = names.index(name)
        if place < len(masks):
            masks[place][kind] = _saved(image, capture, place, kind)
    photos = [replace(p, masks=m) for p, m in zip(capture.photos, masks, strict=True)]
    return replace(capture, photos=tuple(photos))


def _mark(image: bpy.types.Image, capture: str, place: int, name: str, kind: str) -> None:
    image[CAPTURE], image[MASK_PHOTO_INDEX], image[MASK_PHOTO_NAME], image[MASK_KIND] = (
        capture,
        place,
        name,
        kind,
    )
    image.use_fake_user = True  # a mask has no other user
    image.colorspace_settings.name = "Non-Color"


def _saved(image: bpy.types.Image, capture: Capture, place: int, kind: str) -> Path:
    """Write the image's present pixels to a file; returns its path."""
    if 0 in tuple(image.size):
        raise PatinaError(
            f"The mask {image.name!r} has no pixels; remove the image, or recompute the masks"
        )
    folder = masks_folder(capture.file) / "painted"
    file = folder / f"{place + 1:03d}_{capture.photos[place].file.stem}_{kind}.png"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_png(file, read_pixels(image)[..., 0])
        if image.is_dirty:
            image.pack()  # later strokes are then noticed (views/outdated.py)
    except OSError as error:
        raise PatinaError(f"The mask {image.name!r} cannot be written ({error})") from error
    return file


@bpy.app.handlers.persistent
def _pack(*_: object) -> None:
    """Pack edited masks before the .blend is saved."""
    for image in bpy.data.images:
        if (
            MASK_PHOTO_INDEX in image
            and (image.is_dirty or image.packed_file is None)
            and image.has_data
        ):
            image.pack()


HANDLERS = (("save_pre", _pack),)
register, unregister = register_handlers_factory(HANDLERS)
