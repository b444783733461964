"""From a capture to what its photos show, checked: files, sizes, masks, numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture, MaterialEntry
from ..capture.model import SHADOW_MASK
from ..errors import InputError
from ..geometry import SurfaceView
from ..photo import read_mask, read_radiance
from ..photo.image import image_size
from ..scan import Camera, Scan
from ..scan.scan import read_scan


def open_scan(capture: Capture) -> Scan:
    """The capture's scan. Raises InputError naming the capture's key."""
    try:
        return read_scan(capture.cameras, capture.mesh, capture.images)
    except InputError as error:
        key = "mesh" if error.file == capture.mesh else "cameras"
        raise capture.error(str(error), "scan", key) from error


def check_photos(capture: Capture, scan: Scan) -> None:
    """Refuse photos without a camera or of another size than it, and masks of another size than
    their photo. Reads headers only."""
    for place, photo in enumerate(capture.photos):
        camera = camera_of(capture, scan, place)
        size = _size(capture, photo.file, "photo", place, "file")
        if size != (camera.width, camera.height):
            raise capture.error(
                f"{photo.file.name} is {size[0]} × {size[1]} pixels, but its camera "
                f"{camera.label!r} is {camera.width} × {camera.height}",
                "photo", place, "file",
            )  # fmt: skip
        for name, mask in photo.masks.items():
            mask_size = _size(capture, mask, "photo", place, "masks", name)
            if mask_size != size:
                raise capture.error(
                    f"{mask.name} is {mask_size[0]} × {mask_size[1]} pixels, but its photo "
                    f"{photo.file.name} is {size[0]} × {size[1]}",
                    "photo", place, "masks", name,
                )  # fmt: skip


def camera_of(capture: Capture, scan: Scan, place: int) -> Camera:
    """The scan camera of a photo. Raises InputError."""
    label = capture.photos[place].camera
    camera = scan.camera(label)
    if camera is None:
        some = ", ".join(c.label for c in scan.cameras[:3])
        raise capture.error(
            f"the scan has no camera {label!r}; its {len(scan.cameras)} cameras are {some} …",
            "photo", place, "camera",
        )  # fmt: skip
    return camera


def radiance_of(capture: Capture, place: int) -> NDArray[np.float32]:
    """(h, w, 3) linear radiance of a photo, divided by its exposure. Raises InputError."""
    photo = capture.photos[place]
    try:
        pixels = read_radiance(photo.file)
    except InputError as error:
        raise capture.error(str(error), "photo", place, "file") from error
    broken = int((~np.isfinite(pixels)).any(axis=2).sum())
    if broken:
        raise capture.error(
            f"{photo.file.name} has {broken} pixels that are not numbers (NaN or infinite)",
            "photo", place, "file",
        )  # fmt: skip
    return pixels / np.float32(photo.exposure)


def check_face_attributes(capture: Capture, scan: Scan) -> None:
    """Refuse a material whose face attribute the mesh does not have."""
    for place, material in enumerate(capture.materials):
        if material.faces is not None and material.faces not in scan.mesh.face_attributes:
            there = ", ".join(scan.mesh.face_attributes) or "none"
            raise capture.error(
                f"the mesh has no integer face attribute {material.faces!r}; it has: {there}",
                "material", place, "faces",
            )  # fmt: skip


def material_pixels(
    capture: Capture, scan: Scan, view: SurfaceView, place: int
) -> tuple[dict[str, NDArray[np.bool_]], NDArray[np.bool_]]:
    """({material: (n,) its pixels}, (n,) pixels in the shadow mask) of one photo's SurfaceView."""
    photo = capture.photos[place]
    masks = {name: _mask(capture, place, name).ravel()[view.pixel] for name in photo.masks}
    shadow = masks.pop(SHADOW_MASK, np.zeros(len(view.pixel), bool))
    found = {}
    for index, material in enumerate(capture.materials):
        found[material.name] = _one_material(capture, scan, view, material, index, masks)
    return found, shadow


def _one_material(
    capture: Capture,
    scan: Scan,
    view: SurfaceView,
    material: MaterialEntry,
    index: int,
    masks: dict[str, NDArray[np.bool_]],
) -> NDArray[np.bool_]:
    """Where its faces and masks say; a material with neither is what no other one claims."""
    pixels = np.ones(len(view.pixel), bool)
    if material.faces is not None:
        pixels = scan.mesh.face_attributes[material.faces][view.face] == index
    if material.name in masks:
        return pixels & masks[material.name]
    if material.faces is not None:
        return pixels
    if any(capture.named_by_masks(m.name) for m in capture.materials) and not masks:
        return np.zeros_like(pixels)  # painted in other photos: here nobody looked
    if capture.named_by_masks(material.name):
        return np.zeros_like(pixels)
    for other, entry in enumerate(capture.materials):
        if other != index and entry.faces is not None:
            pixels &= scan.mesh.face_attributes[entry.faces][view.face] != other
    for mask in masks.values():
        pixels &= ~mask
    return pixels


def _mask(capture: Capture, place: int, name: str) -> NDArray[np.bool_]:
    try:
        return read_mask(capture.photos[place].masks[name])
    except InputError as error:
        raise capture.error(str(error), "photo", place, "masks", name) from error


def _size(capture: Capture, file: Path, *path: str | int) -> tuple[int, int]:
    try:
        return image_size(file)
    except InputError as error:
        raise capture.error(str(error), *path) from error
