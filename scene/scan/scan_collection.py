"""A capture as a Blender collection: mesh, cameras with their photos, lights."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.capture import Capture
from ...core.errors import PatinaError
from ...core.inputs import capture_data
from ...core.inputs.lights import Lights
from ...core.photo.image import image_size
from ...core.scan import Camera, Reconstruction, Scan
from ..photos import cameras, rectified_photo
from ..photos.lamps import create_lamp
from ..photos.photo_list import LitPhoto, list_photos, mark_lit
from ..property_keys import CAPTURE, ORIGIN, RESOLUTION
from . import meshes
from .face_slots import wear_again
from .origin import frame_origin

log = logging.getLogger(__name__)

PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr")


@dataclass(frozen=True)
class ScanCollection:
    """What was made. cameras: label → object; lights: name → object."""

    collection: bpy.types.Collection
    mesh: bpy.types.Object
    cameras: dict[str, bpy.types.Object]
    lamps: dict[str, bpy.types.Object]


def create_scan_collection(
    scene: bpy.types.Scene, capture: Capture, scan: Scan, found: Lights, rectified: Path
) -> ScanCollection:
    """Everything of a capture, linked into ``scene``; call only when all of it has been parsed.

    rectified: folder for resampled photos of distorted lenses.
    """
    name = capture.file.name.removesuffix(".toml").removesuffix(".capture")
    # photos first: one that cannot be read must leave nothing behind
    own = _own_photos(scan.cameras, scan.images, rectified)
    lit = []
    for place, photo in enumerate(capture.photos):
        camera = capture_data.camera_of(capture, scan, place)
        lit.append((camera, rectified_photo.photo_for(camera, photo.file, rectified), photo))
    top, camera_room, light_room = _rooms(scene, name, ("cameras", "lights"))
    top[CAPTURE] = str(capture.file)
    used = scan.mesh.vertices[np.unique(scan.mesh.faces)]
    origin = frame_origin(used)
    centre = 0.5 * (used.min(axis=0) + used.max(axis=0)) - origin
    top[ORIGIN] = origin.tolist()
    mesh = meshes.create_mesh_object(name, scan.mesh, origin, top)
    wear_again(mesh, str(capture.file))
    made = _cameras(scan.cameras, own, origin, centre, camera_room)
    listed = []
    for place, (camera, shown, photo) in enumerate(lit):
        stood = made[camera.label]
        # a scaled copy of what was calibrated is rendered at its own size
        stood[RESOLUTION] = (camera.width, camera.height)
        image = bpy.data.images.load(str(shown), check_existing=True)
        if CAPTURE not in stood:  # of several photos from one place the list shows one at a time
            cameras.put_photo_behind(stood, shown)
            mark_lit(stood, photo.file.name, place, photo.light)
        stood[CAPTURE] = str(capture.file)
        listed.append(LitPhoto(stood, image, photo))
    lamps = {
        light.name: create_lamp(light, origin, centre, scan.mesh.size, light_room)
        for light in found.by_name.values()
    }
    for lamp in lamps.values():
        lamp[CAPTURE] = str(capture.file)
    list_photos(scene, listed)
    return ScanCollection(top, mesh, made, lamps)


def already_there(scene: bpy.types.Scene, capture: Path) -> bpy.types.Collection | None:
    """The collection an earlier import of this capture made, where its mesh is still in it."""
    for collection in scene.collection.children_recursive:
        if collection.get(CAPTURE) == str(capture.resolve()) and any(
            o.type == "MESH" for o in collection.objects
        ):
            return collection
    return None


def create_reconstruction(
    scene: bpy.types.Scene,
    name: str,
    found: Reconstruction,
    images: Path | None,
    rectified: Path,
) -> None:
    """A reconstruction without a mesh: its cameras and its sparse points."""
    own = _own_photos(found.cameras, images, rectified)
    top, camera_room = _rooms(scene, name, ("cameras",))
    centres = np.array([c.pose.centre for c in found.cameras])
    positions = found.points if len(found.points) else centres
    origin = frame_origin(positions)
    centre = np.median(positions, axis=0) - origin
    if len(found.points):
        meshes.create_points_object(f"{name} points", found.points - origin, found.colours, top)
    made = _cameras(found.cameras, own, origin, centre, camera_room)
    cameras.look_through(scene, next(iter(made.values())))


def _rooms(
    scene: bpy.types.Scene, name: str, parts: Sequence[str]
) -> tuple[bpy.types.Collection, ...]:
    """A collection and one inside it for every part."""
    top = bpy.data.collections.new(f"Patina {name}")
    scene.collection.children.link(top)
    rooms = [bpy.data.collections.new(f"{name} {part}") for part in parts]
    for room in rooms:
        top.children.link(room)
    return (top, *rooms)


def _cameras(
    found: Sequence[Camera],
    own: dict[str, Path],
    origin: NDArray[np.float64],
    centre: NDArray[np.float64],
    room: bpy.types.Collection,
) -> dict[str, bpy.types.Object]:
    made = {}
    for camera in found:
        distance = float(np.linalg.norm(camera.pose.centre - origin - centre))
        made[camera.label] = cameras.create_camera(camera, origin, distance, room)
        if camera.label in own:
            cameras.put_photo_behind(made[camera.label], own[camera.label])
    return made


def _own_photos(found: Sequence[Camera], images: Path | None, rectified: Path) -> dict[str, Path]:
    """The scan's own photos, where it is known where they lie: label → file to show."""
    there = ((camera, _own_photo(images, camera.label)) for camera in found)
    shown = {}
    for camera, photo in there:
        if photo is None:
            continue
        try:
            shown[camera.label] = rectified_photo.photo_for(
                camera.resized(*image_size(photo)), photo, rectified
            )
        except PatinaError as error:
            log.warning("the photo of camera %s is not shown: %s", camera.label, error)
    return shown


def _own_photo(images: Path | None, label: str) -> Path | None:
    """The scan's own photo of a camera, where it is known where the photos lie."""
    if images is None:
        return None
    names = [label, *(f"{label}{suffix}" for suffix in PICTURES)]
    return next((images / name for name in names if (images / name).is_file()), None)
