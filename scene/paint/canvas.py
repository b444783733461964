"""A photo to paint on in the Image Editor: what each part of it is, as colours over the photo.

A canvas shows the photo with materials and what is left out laid over it. Strokes on it are what
differs from how it was drawn; they are carried to the mesh, or into the photo's masks, and it is
drawn anew. It is only a view: nothing is kept in it, and no .blend needs it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture.model import LEFT_OUT
from ...core.errors import PatinaError
from ...core.inputs.photos import LitPhotos
from ...core.masks.carry import NONE, carried
from ...core.masks.strokes import overlaid, strokes
from ...core.views.display import srgb, white_level
from ..property_keys import CANVAS_PHOTO, CAPTURE
from ..scan.scan_rays import ScanRays, scan_rays
from ..session.handlers import attach, detach
from ..session.scene_properties import capture_path
from .mask_images import mask_images, read_mask_image, read_pixels, store_mask, write_pixels
from .paint_kinds import ERASE, Paint, paints, palette, wear, worn_slots

log = logging.getLogger(__name__)

LARGEST = 2048  # pixels a side that are painted on; larger photos are shown smaller

_photos: dict[str, NDArray[np.uint8]] = {}  # name of the canvas → its photo,
_drawn: dict[str, NDArray[np.uint8]] = {}  # and as it was drawn last


def canvases(capture: str) -> dict[int, bpy.types.Image]:
    """Place of the photo → its canvas."""
    return {
        int(image[CANVAS_PHOTO]): image
        for image in bpy.data.images
        if image.get(CAPTURE) == capture and CANVAS_PHOTO in image and image.name in _drawn
    }


def canvas_of(scene: bpy.types.Scene, capture: str, place: int) -> bpy.types.Image:
    """The canvas of one photo, drawn as things are now. Raises PatinaError for a capture or photo
    that cannot be read, and for a mesh that is not the scan's any more."""
    image = canvases(capture).get(place)
    if image is None:
        found = scan_rays(capture)
        photo = LitPhotos.open(found.capture).read(place).radiance
        step = max(1, int(np.ceil(max(photo.shape[:2]) / LARGEST)))
        picture = srgb(photo[::step, ::step] / white_level(photo))
        height, width = picture.shape[:2]
        name = f"Paint: {found.capture.photos[place].file.name}"
        image = bpy.data.images.new(name, width, height)
        image[CAPTURE], image[CANVAS_PHOTO] = capture, place
        _photos[image.name] = picture
    draw(scene, capture, image)
    return image


def draw(scene: bpy.types.Scene, capture: str, image: bpy.types.Image) -> None:
    """Materials and what is left out over the photo. Strokes that were not taken are lost."""
    found = scan_rays(capture)
    place, picture = int(image[CANVAS_PHOTO]), _photos[image.name]
    there = paints(scene)
    worn = np.full(picture.shape[:2], NONE, np.int32)
    mesh = scene.patina.mesh
    if scene.patina.use_slots and len(mesh.material_slots) > 1:
        slots = _checked(found, mesh)
        worn = _small(found.faces_of(place).image(slots), picture.shape).copy()
    masks = mask_images(capture)
    for number, paint in enumerate(there):
        if (place, paint.kind) in masks:
            worn[_small(read_mask_image(masks[place, paint.kind]), picture.shape)] = number
    shown = overlaid(picture, worn, palette(there), scene.patina_paint.opacity)
    write_pixels(image, shown)
    image.pack()  # else Blender may let its pixels go, and show black
    _drawn[image.name] = shown


def take_strokes(scene: bpy.types.Scene, capture: str) -> int:
    """What was painted on all canvases, onto the mesh and into masks; how many pixels that is.
    Raises PatinaError where the mesh is not the scan's any more."""
    there = canvases(capture)
    kinds, painted = paints(scene), {}
    for place, image in there.items():
        now = read_pixels(image)
        if not now.any():  # Blender let its pixels go, and nobody painted all of it black
            continue
        found = strokes(_drawn[image.name], now, palette(kinds))
        if (found >= 0).any():
            painted[place] = found
    if painted:
        scan = scan_rays(capture)
        _onto_mesh(scene, scan, kinds, painted)
        for place, found in painted.items():
            _into_masks(scan, capture, place, kinds, found)
    for image in there.values():
        draw(scene, capture, image)
    return sum(int((found >= 0).sum()) for found in painted.values())


def _onto_mesh(
    scene: bpy.types.Scene,
    scan: ScanRays,
    kinds: Sequence[Paint],
    painted: dict[int, NDArray[np.int32]],
) -> None:
    """Materials, by the votes of all photos that were painted on."""
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
        wear(mesh, carried(_checked(scan, mesh), votes))
        scene.patina.use_slots = True


def _into_masks(
    scan: ScanRays, capture: str, place: int, kinds: Sequence[Paint], found: NDArray[np.int32]
) -> None:
    """What is left out of one photo; the eraser takes of all kinds."""
    camera_shape = scan.faces_of(place).shape
    erased = np.isin(found, [n for n, paint in enumerate(kinds) if paint.kind == ERASE])
    masks, name = mask_images(capture), scan.capture.photos[place].file.name
    for kind in LEFT_OUT:
        number = next(n for n, paint in enumerate(kinds) if paint.kind == kind)
        new, old = found == number, masks.get((place, kind))
        if not new.any() and (old is None or not erased.any()):
            continue
        # the greys of a shadow's soft edge stay where nobody painted
        grey = read_pixels(old)[..., 0] if old is not None else np.zeros(camera_shape, np.uint8)
        grey[_whole(new, grey.shape)] = 255
        # what is painted as one kind is no longer another
        others = erased | ((found >= 0) & ~new & np.isin(found, _outs(kinds)))
        grey[_whole(others, grey.shape)] = 0
        store_mask(capture, place, name, kind, grey)


def _outs(kinds: Sequence[Paint]) -> list[int]:
    return [n for n, paint in enumerate(kinds) if paint.kind in LEFT_OUT]


def _whole(values: NDArray, shape: tuple[int, ...]) -> NDArray:
    """A canvas (h, w) at the size of its photo."""
    step = _step(shape, values.shape)
    wide = np.repeat(np.repeat(values, step, axis=0), step, axis=1)
    return wide[: shape[0], : shape[1]]


def _small(values: NDArray, shape: tuple[int, ...]) -> NDArray:
    """What is as large as a photo at the size of its canvas."""
    step = _step(values.shape, shape)
    return values[::step, ::step]


def _step(photo: tuple[int, ...], canvas: tuple[int, ...]) -> int:
    """Pixels of a photo (h, w) for one of its canvas (h, w)."""
    return -(-photo[0] // canvas[0])


def _checked(found: ScanRays, mesh: bpy.types.Object) -> NDArray[np.int32]:
    """What the faces wear. Raises PatinaError where they are not the scan's any more."""
    slots = worn_slots(mesh)
    if len(slots) != len(found.scan.mesh.faces):
        raise PatinaError(
            f"{mesh.name} has {len(slots):,} faces, the scan {len(found.scan.mesh.faces):,}: "
            "import the capture anew, or undo what cut the mesh"
        )
    return slots


@bpy.app.handlers.persistent
def _clear(*_: object) -> None:
    """Another file: its canvases are blank, and drawn anew when they are asked for."""
    _photos.clear()
    _drawn.clear()
    for image in [image for image in bpy.data.images if CANVAS_PHOTO in image]:
        bpy.data.images.remove(image)


@bpy.app.handlers.persistent
def _take(*_: object) -> None:
    """Strokes go where they belong before the file is saved."""
    for scene in bpy.data.scenes:
        try:
            take_strokes(scene, capture_path(scene))
        except PatinaError as error:  # saving goes on
            log.error("strokes were not taken: %s", error)


HANDLERS = (("load_post", _clear), ("save_pre", _take))


def register() -> None:
    """Watch files."""
    attach(HANDLERS)


def unregister() -> None:
    """No more, and no canvases."""
    detach(HANDLERS)
    _clear()
