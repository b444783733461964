"""From a capture to what its photos show, checked: files, sizes, masks, numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture, MaterialEntry
from ..capture.model import LEFT_OUT
from ..errors import InputError, PatinaError
from ..geometry import SurfaceView
from ..photo import read_encoded, read_mask
from ..photo.image import image_size
from ..scan import Camera, Scan
from ..scan.scan import read_scan, with_extra_cameras
from .painted_faces import faces_by_texture, faces_by_vertex_colour

PAINTED = "patina_painted"  # face attribute: place of the material painted on the mesh, −1 none


def open_scan(capture: Capture) -> Scan:
    """The capture's scan. Raises InputError naming the capture's key."""
    said = capture.scan
    try:
        scan = read_scan(said.cameras, said.mesh, said.images, said.chunk, said.frame)
        if said.extra is not None:
            scan = with_extra_cameras(scan, said.extra)
    except InputError as error:
        named = (error.key or "").removeprefix("scan.")
        key = named if named in ("frame", "chunk") else "cameras"
        if error.file is not None:
            at_fault = Path(error.file)
            key = "mesh" if at_fault == said.mesh != said.cameras else key
            key = "extra" if at_fault == said.extra else key
        raise capture.error(str(error), "scan", key) from error
    return with_painted_faces(capture, scan)


def check_photos(capture: Capture, scan: Scan) -> None:
    """Refuse photos without a camera or of another size than it, and masks of another size than
    their photo. Reads headers only."""
    for place, photo in enumerate(capture.photos):
        camera = camera_of(capture, scan, place)
        size = camera.width, camera.height
        for file in photo.files[1:]:
            other = _size(capture, file, "photo", place, "file")
            if other != size:
                raise capture.error(
                    f"{file.name} is {other[0]} × {other[1]} pixels, {photo.file.name} is "
                    f"{size[0]} × {size[1]}: they are not of one viewpoint",
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
    """The scan camera of a photo, scaled to the photo's size. Raises InputError."""
    label = capture.photos[place].camera
    camera = scan.camera(label)
    if camera is None:
        some = ", ".join(c.label for c in scan.cameras[:3])
        raise capture.error(
            f"the scan has no camera {label!r}; its {len(scan.cameras)} cameras are {some} …",
            "photo", place, "camera",
        )  # fmt: skip
    width, height = _size(capture, capture.photos[place].file, "photo", place, "file")
    try:
        return camera.resized(width, height)
    except PatinaError as error:
        raise capture.error(
            f"{capture.photos[place].file.name} is not a photo of its camera {camera.label!r}: "
            f"{error}",
            "photo", place, "file",
        ) from error  # fmt: skip


def size_notes(capture: Capture, scan: Scan) -> tuple[str, ...]:
    """A sentence where photos are scaled copies of what was calibrated."""
    scaled = []
    for place, photo in enumerate(capture.photos):
        original = scan.camera(photo.camera)
        camera = camera_of(capture, scan, place)
        if original is not None and original.width != camera.width:
            scaled.append(camera.width / original.width)
    if not scaled:
        return ()
    return (
        f"{len(scaled)} photos are {min(scaled):.3g} times the size their cameras were calibrated "
        "at: the cameras are scaled with them",
    )


def unused_settings(capture: Capture) -> tuple[str, ...]:
    """A sentence where [fit] gives settings of a method that is not used."""
    if not capture.fit.unused:
        return ()
    return (
        f"[fit] {', '.join(capture.fit.unused)} changed nothing: what the paper's method takes; "
        'method = "paper" uses it',
    )


def face_attribute(material: MaterialEntry) -> str | None:
    """The mesh's face attribute that says where a material is, None for one by masks."""
    if material.vertex_colour is not None or material.texture_colour is not None:
        return PAINTED
    return material.faces


def check_face_attributes(capture: Capture, scan: Scan) -> None:
    """Refuse a material whose face attribute the mesh does not have."""
    for place, material in enumerate(capture.materials):
        if material.faces is not None and material.faces not in scan.mesh.face_attributes:
            there = ", ".join(scan.mesh.face_attributes) or "none"
            raise capture.error(
                f"the mesh has no integer face attribute {material.faces!r}; it has: {there}",
                "material", place, "faces",
            )  # fmt: skip


def with_painted_faces(capture: Capture, scan: Scan) -> Scan:
    """The scan with a face attribute for the materials painted on vertices or in the texture.
    Raises InputError where the mesh has no such colours."""
    painted = np.full(len(scan.mesh.faces), -1, np.int32)
    for key in ("vertex_colour", "texture_colour"):
        places = [i for i, m in enumerate(capture.materials) if getattr(m, key) is not None]
        if not places:
            continue
        colours = [getattr(capture.materials[i], key) for i in places]
        try:
            if key == "vertex_colour":
                found = faces_by_vertex_colour(scan.mesh, colours)
            else:
                found = _textured(capture, scan, colours)
        except PatinaError as error:
            raise capture.error(str(error), "material", places[0], key) from error
        painted = np.where(found >= 0, np.array(places, np.int32)[found], painted)
    for place, material in enumerate(capture.materials):
        if face_attribute(material) == PAINTED and not (painted == place).any():
            key = "vertex_colour" if material.vertex_colour is not None else "texture_colour"
            raise capture.error("no face of the mesh has this colour", "material", place, key)
    if (painted < 0).all():
        return scan
    attributes = {**scan.mesh.face_attributes, PAINTED: painted.astype(np.int32)}
    return replace(scan, mesh=replace(scan.mesh, face_attributes=attributes))


def _textured(
    capture: Capture, scan: Scan, colours: list[tuple[int, int, int]]
) -> NDArray[np.int32]:
    """(f,) which of the colours covers each face, in the texture that it wears."""
    mesh = scan.mesh
    given = capture.scan.texture
    files = (given,) if given is not None else mesh.textures
    if not any(files):
        raise InputError("the mesh names no texture: give one with [scan] texture")
    found = np.full(len(mesh.faces), -1, np.int32)
    for i, file in enumerate(files):
        if file is None:
            continue
        wearing = mesh.face_attributes["material"] == i if len(files) > 1 else None
        image = np.round(255 * np.clip(read_encoded(file), 0, 1)).astype(np.uint8)
        found = np.maximum(found, faces_by_texture(mesh, image, colours, faces=wearing))
    return found


def photo_masks(capture: Capture, place: int) -> dict[str, NDArray[np.bool_]]:
    """{name: (h, w) where it is white} of one photo's masks. Raises InputError."""
    return {name: _mask(capture, place, name) for name in capture.photos[place].masks}


def material_pixels(
    capture: Capture,
    scan: Scan,
    view: SurfaceView,
    place: int,
    read: Mapping[str, NDArray[np.bool_]] | None = None,
) -> tuple[dict[str, NDArray[np.bool_]], NDArray[np.bool_]]:
    """({material: (n,) its pixels}, (n,) pixels in one of the masks LEFT_OUT) of one photo's
    SurfaceView. read: what photo_masks gave, where it is asked for more than once."""
    whole = photo_masks(capture, place) if read is None else read
    masks = {name: mask.ravel().take(view.pixel) for name, mask in whole.items()}
    out = np.zeros(len(view.pixel), bool)
    for name in LEFT_OUT:
        out |= masks.pop(name, out)
    found = {}
    for index, material in enumerate(capture.materials):
        found[material.name] = _one_material(capture, scan, view, material, index, masks)
    return found, out


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
    attribute = face_attribute(material)
    if attribute is not None:
        pixels = scan.mesh.face_attributes[attribute][view.face] == index
    if material.name in masks:
        return pixels & masks[material.name]
    if attribute is not None:
        return pixels
    if any(capture.named_by_masks(m.name) for m in capture.materials) and not masks:
        return np.zeros_like(pixels)  # painted in other photos: here nobody looked
    if capture.named_by_masks(material.name):
        return np.zeros_like(pixels)
    for other, entry in enumerate(capture.materials):
        others = face_attribute(entry)
        if other != index and others is not None:
            pixels &= scan.mesh.face_attributes[others][view.face] != other
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
