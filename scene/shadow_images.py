"""Shadow masks as Blender images: seen, painted over, and read back by the next fit."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import bpy

from ..core.capture import Capture
from ..core.capture.model import SHADOW_MASK
from ..core.errors import PatinaError
from .folders import blend_folder
from .properties import CAPTURE

PLACE = "patina_shadow_of"  # on the image: place of its photo in the capture


def masks_folder(capture: Path) -> Path:
    """For the masks of one capture: two captures may have the same names."""
    digest = hashlib.sha256(str(capture.resolve()).encode()).hexdigest()[:8]
    return blend_folder() / "masks" / f"{capture.name.split('.')[0]}-{digest}"


def shadow_images(capture: str) -> dict[int, bpy.types.Image]:
    """Place of the photo → its shadow mask, of those in this .blend."""
    return {
        int(image[PLACE]): image
        for image in bpy.data.images
        if image.get(CAPTURE) == capture and PLACE in image
    }


def show_shadow_masks(scene: bpy.types.Scene, capture: str, files: list[Path]) -> None:
    """Load the masks, one a photo; an open image editor shows that of the camera looked through."""
    there = shadow_images(capture)
    for place, file in enumerate(files):
        image = there.get(place)
        if image is None:
            image = bpy.data.images.load(str(file))
            image[CAPTURE], image[PLACE] = capture, place
            image.use_fake_user = True  # a mask has no other user
            there[place] = image
        else:
            image.filepath = str(file)
            image.reload()
        image.colorspace_settings.name = "Non-Color"
    camera = scene.camera
    shown = there.get(camera.get("patina_place", 0) if camera is not None else 0)
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = shown


def with_shadow_images(capture: Capture) -> Capture:
    """The capture with the shadow masks that are in this .blend in place of its own; what was
    painted since they were saved is saved. Raises PatinaError where that is not possible."""
    there = shadow_images(str(capture.file))
    photos = []
    for place, photo in enumerate(capture.photos):
        image = there.get(place)
        if image is not None:
            photo = replace(photo, masks={**photo.masks, SHADOW_MASK: _saved(image)})
        photos.append(photo)
    return replace(capture, photos=tuple(photos))


def _saved(image: bpy.types.Image) -> Path:
    file = Path(bpy.path.abspath(image.filepath))
    try:
        if image.is_dirty:
            image.save()
    except RuntimeError as error:
        raise PatinaError(f"the shadow mask {image.name!r} cannot be saved ({error})") from error
    if not file.is_file():
        raise PatinaError(
            f"the shadow mask {image.name!r} is gone ({file}): remove the image, or make the "
            "masks anew"
        )
    return file
