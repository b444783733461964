"""Canvases: photos to paint on in the Image Editor, with materials and masks as colours.

A canvas shows a photo overlaid with its materials and masks. Pixels that differ from the drawn
overlay are strokes; they are transferred to the mesh or to the photo's masks, and the canvas is
drawn again. A canvas stores no data of its own.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture.model import EXCLUDED_MASKS
from ...core.errors import PatinaError
from ...core.inputs.photos import LitPhotos
from ...core.masks.carry import NONE, updated_labels
from ...core.masks.strokes import overlaid, strokes
from ...core.views.display import srgb, white_level
from ..property_keys import CANVAS_PHOTO, CAPTURE
from ..scan.scan_rays import ScanRays, scan_rays
from ..session.handlers import attach, detach
from ..session.scene_properties import capture_path
from .mask_images import mask_images, read_mask_image, read_pixels, store_mask, write_pixels
from .paint_kinds import ERASE, Paint, assign_slots, paints, palette, slots_of_faces

log = logging.getLogger(__name__)

MAX_CANVAS_SIDE = 2048  # longest side of a canvas, pixels; larger photos are shown reduced

_photos: dict[str, NDArray[np.uint8]] = {}  # name of the canvas → its photo, (h, w, 3) sRGB
_drawn: dict[str, NDArray[np.uint8]] = {}  # name of the canvas → its pixels as last drawn


def canvases(capture: str) -> dict[int, bpy.types.Image]:
    """Index of the photo in the capture → its canvas."""
    return {
        int(image[CANVAS_PHOTO]): image
        for image in bpy.data.images
        if image.get(CAPTURE) == capture and CANVAS_PHOTO in image and image.name in _drawn
    }


def canvas_of(scene: bpy.types.Scene, capture: str, place: int) -> bpy.types.Image:
    """The canvas of one photo, drawn with the present materials and masks.

    place: index of the photo in the capture. Raises PatinaError if the capture or the photo cannot
    be read, or if the mesh no longer has the scan's faces.
    """
    image = canvases(capture).get(place)
    if image is None:
        found = scan_rays(capture)
        photo = LitPhotos.open(found.capture).read(place).radiance
        step = max(1, int(np.ceil(max(photo.shape[:2]) / MAX_CANVAS_SIDE)))
        picture = srgb(photo[::step, ::step] / white_level(photo))
        height, width = picture.shape[:2]
        name = f"Paint: {found.capture.photos[place].file.name}"
        image = bpy.data.images.new(name, width, height)
        image[CAPTURE], image[CANVAS_PHOTO] = capture, place
        _photos[image.name] = picture
    draw(scene, capture, image)
    return image


def draw(scene: bpy.types.Scene, capture: str, image: bpy.types.Image) -> None:
    """Draw the photo overlaid with materials and masks. Strokes that were not applied are lost."""
    found = scan_rays(capture)
    place, picture = int(image[CANVAS_PHOTO]), _photos[image.name]
    kinds = paints(scene)
    drawn = np.full(picture.shape[:2], NONE, np.int32)
    mesh = scene.patina.mesh
    if scene.patina.use_slots and len(mesh.material_slots) > 1:
        slots = _checked(found, mesh)
        drawn = _small(found.faces_of(place).image(slots), picture.shape).copy()
    masks = mask_images(capture)
    for number, paint in enumerate(kinds):
        if (place, paint.kind) in masks:
            drawn[_small(read_mask_image(masks[place, paint.kind]), picture.shape)] = number
    shown = overlaid(picture, drawn, palette(kinds), scene.patina_paint.opacity)
    write_pixels(image, shown)
    image.pack()  # otherwise Blender may free its pixels and show black
    _drawn[image.name] = shown


def apply_photo_strokes(scene: bpy.types.Scene, capture: str) -> int:
    """Apply the strokes on all canvases to the mesh and the masks; returns the number of painted
    pixels. Raises PatinaError if the mesh no longer has the scan's faces."""
    images = canvases(capture)
    kinds, painted = paints(scene), {}
    for place, image in images.items():
        pixels = read_pixels(image)
        if not pixels.any():  # all black: Blender has freed the pixels
            continue
        found = strokes(_drawn[image.name], pixels, palette(kinds))
        if (found >= 0).any():
            painted[place] = found
    if painted:
        scan = scan_rays(capture)
        _onto_mesh(scene, scan, kinds, painted)
        for place, found in painted.items():
            _into_masks(scan, capture, place, kinds, found)
    for image in images.values():
        draw(scene, capture, image)
    return sum(int((found >= 0).sum()) for found in painted.values())


def _onto_mesh(
    scene: bpy.types.Scene,
    scan: ScanRays,
    kinds: Sequence[Paint],
    painted: dict[int, NDArray[np.int32]],
) -> None:
    """Apply strokes of materials to the faces, by the votes of all painted photos."""
    count = sum(paint.kind == "material" for paint in kinds)
    votes: NDArray[np.int64] | None = None
    for place, found in painted.items():
        if ((found >= 0) & (found < count)).any():
            seen = scan.faces_of(place)
            whole = _whole(np.where(found < count, found, NONE), seen.shape)
            mine = seen.votes(whole, count, len(scan.scan.mesh.faces))
            votes = mine if votes is None else votes + mine
    if votes is not None:
        mesh = scene.patina.mesh
        assign_slots(mesh, updated_labels(_checked(scan, mesh), votes))
        scene.patina.use_slots = True


def _into_masks(
    scan: ScanRays, capture: str, place: int, kinds: Sequence[Paint], found: NDArray[np.int32]
) -> None:
    """Apply strokes of masks to one photo; the eraser removes masks of all kinds."""
    camera_shape = scan.faces_of(place).shape
    erased = np.isin(found, [n for n, paint in enumerate(kinds) if paint.kind == ERASE])
    masks, name = mask_images(capture), scan.capture.photos[place].file.name
    for kind in EXCLUDED_MASKS:
        number = next(n for n, paint in enumerate(kinds) if paint.kind == kind)
        new, old = found == number, masks.get((place, kind))
        if not new.any() and (old is None or not erased.any()):
            continue
        # unpainted pixels keep the grey values of a shadow's soft edge
        grey = read_pixels(old)[..., 0] if old is not None else np.zeros(camera_shape, np.uint8)
        grey[_whole(new, grey.shape)] = 255
        # pixels painted as one kind are removed from the others
        others = erased | ((found >= 0) & ~new & np.isin(found, _mask_numbers(kinds)))
        grey[_whole(others, grey.shape)] = 0
        store_mask(capture, place, name, kind, grey)


def _mask_numbers(kinds: Sequence[Paint]) -> list[int]:
    return [n for n, paint in enumerate(kinds) if paint.kind in EXCLUDED_MASKS]


def _whole(values: NDArray, shape: tuple[int, ...]) -> NDArray:
    """Values on a canvas (h, w), enlarged to the size of its photo."""
    step = _step(shape, values.shape)
    wide = np.repeat(np.repeat(values, step, axis=0), step, axis=1)
    return wide[: shape[0], : shape[1]]


def _small(values: NDArray, shape: tuple[int, ...]) -> NDArray:
    """Values on a photo (h, w), reduced to the size of its canvas."""
    step = _step(values.shape, shape)
    return values[::step, ::step]


def _step(photo: tuple[int, ...], canvas: tuple[int, ...]) -> int:
    """Pixels of a photo (h, w) per pixel of its canvas (h, w), along each axis."""
    return -(-photo[0] // canvas[0])


def _checked(found: ScanRays, mesh: bpy.types.Object) -> NDArray[np.int32]:
    """(faces,) material slots of the faces. Raises PatinaError if the mesh no longer has the scan's
    faces."""
    slots = slots_of_faces(mesh)
    if len(slots) != len(found.scan.mesh.faces):
        raise PatinaError(
            f"{mesh.name} has {len(slots):,} faces, the scan has {len(found.scan.mesh.faces):,}; "
            "import the capture again, or undo the edit of the mesh"
        )
    return slots


@bpy.app.handlers.persistent
def _clear(*_: object) -> None:
    """After loading a file, remove its canvases; they are created again on demand."""
    _photos.clear()
    _drawn.clear()
    for image in [image for image in bpy.data.images if CANVAS_PHOTO in image]:
        bpy.data.images.remove(image)


@bpy.app.handlers.persistent
def _take(*_: object) -> None:
    """Apply strokes before the file is saved."""
    for scene in bpy.data.scenes:
        try:
            apply_photo_strokes(scene, capture_path(scene))
        except PatinaError as error:  # the file is saved nevertheless
            log.error("Painted strokes were not applied: %s", error)


HANDLERS = (("load_post", _clear), ("save_pre", _take))


def register() -> None:
    """Add the handlers for loading and saving."""
    attach(HANDLERS)


def unregister() -> None:
    """Remove the handlers and the canvases."""
    detach(HANDLERS)
    _clear()
