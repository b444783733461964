"""Open the scan, photos and masks of a capture and check that they belong together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..errors import InputError, PatinaError
from ..photo import read_encoded, read_mask
from ..photo.image import image_size
from ..scan import Camera, Scan
from ..scan.scan import read_scan, with_extra_cameras
from .material_pixels import PAINTED, face_attribute
from .painted_faces import faces_by_texture, faces_by_vertex_colour


def open_scan(capture: Capture) -> Scan:
    """The capture's scan. Raises InputError naming the capture's key."""
    entry = capture.scan
    try:
        scan = read_scan(entry.cameras, entry.mesh, entry.images, entry.chunk, entry.frame)
        if entry.extra is not None:
            scan = with_extra_cameras(scan, entry.extra)
    except InputError as error:
        named = (error.key or "").removeprefix("scan.")
        key = named if named in ("frame", "chunk") else "cameras"
        if error.file is not None:
            at_fault = Path(error.file)
            key = "mesh" if at_fault == entry.mesh != entry.cameras else key
            key = "extra" if at_fault == entry.extra else key
        raise capture.error(str(error), "scan", key) from error
    return with_painted_faces(capture, scan)


def check_photos(capture: Capture, scan: Scan) -> None:
    """Check that each photo has a camera of its aspect ratio, and each mask the size of its photo.

    Reads headers only. Raises InputError.
    """
    for place, photo in enumerate(capture.photos):
        camera = camera_of(capture, scan, place)
        size = camera.width, camera.height
        for file in photo.files[1:]:
            other = _size(capture, file, "photo", place, "file")
            if other != size:
                raise capture.error(
                    f"{file.name} is {other[0]} × {other[1]} pixels, but {photo.file.name} is "
                    f"{size[0]} × {size[1]}; expected exposures of one viewpoint, all of one size",
                    "photo", place, "file",
                )  # fmt: skip
        for name, mask in photo.masks.items():
            mask_size = _size(capture, mask, "photo", place, "masks", name)
            if mask_size != size:
                raise capture.error(
                    f"the mask {mask.name} is {mask_size[0]} × {mask_size[1]} pixels; expected "
                    f"{size[0]} × {size[1]}, the size of its photo {photo.file.name}",
                    "photo", place, "masks", name,
                )  # fmt: skip


def camera_of(capture: Capture, scan: Scan, place: int) -> Camera:
    """The scan camera of a photo, scaled to the photo's size. Raises InputError."""
    label = capture.photos[place].camera
    camera = scan.camera(label)
    if camera is None:
        some = ", ".join(c.label for c in scan.cameras[:3])
        raise capture.error(
            f"the scan has no camera {label!r}; expected one of its {len(scan.cameras)} cameras, "
            f"such as {some}",
            "photo", place, "camera",
        )  # fmt: skip
    width, height = _size(capture, capture.photos[place].file, "photo", place, "file")
    try:
        return camera.resized(width, height)
    except PatinaError as error:
        raise capture.error(
            f"{capture.photos[place].file.name} does not fit its camera {camera.label!r}: {error}",
            "photo", place, "file",
        ) from error  # fmt: skip


def size_notes(capture: Capture, scan: Scan) -> tuple[str, ...]:
    """A note where photos have another resolution than their calibrated cameras."""
    scaled = []
    for place, photo in enumerate(capture.photos):
        original = scan.camera(photo.camera)
        camera = camera_of(capture, scan, place)
        if original is not None and original.width != camera.width:
            scaled.append(camera.width / original.width)
    if not scaled:
        return ()
    return (
        f"Photos with another resolution than their calibrated cameras: {len(scaled)} (by a factor "
        f"of {min(scaled):.3g} or more). The cameras are scaled to match.",
    )


def unused_settings(capture: Capture) -> tuple[str, ...]:
    """A note where [fit] gives settings of a method that is not used."""
    if not capture.fit.unused:
        return ()
    return (
        f"[fit] {', '.join(capture.fit.unused)}: no effect, because only the paper's method reads "
        'it. Set method = "paper" to use it.',
    )


def check_face_attributes(capture: Capture, scan: Scan) -> None:
    """Raise InputError for a material whose face attribute the mesh does not have."""
    for place, material in enumerate(capture.materials):
        if material.faces is not None and material.faces not in scan.mesh.face_attributes:
            there = ", ".join(scan.mesh.face_attributes) or "none"
            raise capture.error(
                f"the mesh has no integer face attribute {material.faces!r}; expected one of its "
                f"attributes: {there}",
                "material", place, "faces",
            )  # fmt: skip


def with_painted_faces(capture: Capture, scan: Scan) -> Scan:
    """The scan with the face attribute PAINTED for materials painted on vertices or in the texture.

    Raises InputError where the mesh has no such colours.
    """
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
            raise capture.error(
                "no face of the mesh has this colour; expected an sRGB colour painted on it",
                "material",
                place,
                key,
            )
    if (painted < 0).all():
        return scan
    attributes = {**scan.mesh.face_attributes, PAINTED: painted.astype(np.int32)}
    return replace(scan, mesh=replace(scan.mesh, face_attributes=attributes))


def _textured(
    capture: Capture, scan: Scan, colours: list[tuple[int, int, int]]
) -> NDArray[np.int32]:
    """(f,) index of the colour that covers each face in its own texture, −1 for none."""
    mesh = scan.mesh
    given = capture.scan.texture
    files = (given,) if given is not None else mesh.textures
    if not any(files):
        raise InputError("the mesh refers to no texture; give one with [scan] texture")
    found = np.full(len(mesh.faces), -1, np.int32)
    for i, file in enumerate(files):
        if file is None:
            continue
        wearing = mesh.face_attributes["material"] == i if len(files) > 1 else None
        image = np.round(255 * np.clip(read_encoded(file), 0, 1)).astype(np.uint8)
        found = np.maximum(found, faces_by_texture(mesh, image, colours, faces=wearing))
    return found


def photo_masks(capture: Capture, place: int) -> dict[str, NDArray[np.bool_]]:
    """{name: (h, w) True where white} for the masks of one photo. Raises InputError."""
    return {name: _mask(capture, place, name) for name in capture.photos[place].masks}


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
