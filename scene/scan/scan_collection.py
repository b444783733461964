"""A capture as a Blender collection: mesh, cameras with their photos, and lights."""

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
from ...core.scan.up_axis import find_up
from ..photos import cameras, rectified_photo
from ..photos.lamps import create_lamp
from ..photos.photo_list import LitPhoto, list_photos, mark_lit
from ..property_keys import CAPTURE, LIGHT_GUESS, ORIGIN, RESOLUTION, STATED_ERROR
from . import meshes
from .face_slots import reassign_slots
from .orientation import store_found
from .origin import frame_origin

log = logging.getLogger(__name__)

PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr")


@dataclass(frozen=True)
class ScanCollection:
    """The objects of an imported capture. cameras: label → object; lamps: name → object."""

    collection: bpy.types.Collection
    mesh: bpy.types.Object
    cameras: dict[str, bpy.types.Object]
    lamps: dict[str, bpy.types.Object]


def create_scan_collection(
    scene: bpy.types.Scene, capture: Capture, scan: Scan, found: Lights, rectified: Path
) -> ScanCollection:
    """Create the objects of a capture in ``scene``, in the scan's frame (set_upright turns them
    afterwards). Call it only after all files were read.

    rectified: folder for resampled photos of distorted lenses. Raises PatinaError if a lit photo
    cannot be read.
    """
    name = capture.file.name.removesuffix(".toml").removesuffix(".capture")
    # photos first: an error must occur before anything is created
    own = _own_photos(scan.cameras, scan.images, rectified)
    lit = []
    for place, photo in enumerate(capture.photos):
        camera = capture_data.camera_of(capture, scan, place)
        lit.append((camera, rectified_photo.photo_for(camera, photo.file, rectified), photo))
    top, camera_collection, light_collection = _collections(scene, name, ("cameras", "lights"))
    top[CAPTURE] = str(capture.file)
    used = scan.mesh.vertices[np.unique(scan.mesh.faces)]
    origin = frame_origin(used)
    centre = 0.5 * (used.min(axis=0) + used.max(axis=0)) - origin
    top[ORIGIN] = origin.tolist()
    mesh = meshes.create_mesh_object(name, scan.mesh, origin, top)
    reassign_slots(mesh, str(capture.file))
    made = _cameras(scan.cameras, own, origin, centre, camera_collection)
    listed = []
    for place, (camera, shown, photo) in enumerate(lit):
        stood = made[camera.label]
        # photos that are scaled copies of the calibrated ones are rendered at their own size
        stood[RESOLUTION] = (camera.width, camera.height)
        image = bpy.data.images.load(str(shown), check_existing=True)
        if CAPTURE not in stood:  # of several photos by one camera, the first is shown
            cameras.put_photo_behind(stood, shown)
            mark_lit(stood, photo.file.name, place, photo.light)
        stood[CAPTURE] = str(capture.file)
        listed.append(LitPhoto(stood, image, photo))
    lamps = {
        light.name: create_lamp(light, origin, centre, scan.mesh.size, light_collection)
        for light in found.by_name.values()
    }
    for entry in capture.lights:
        lamp = lamps[entry.name]
        lamp[CAPTURE], lamp[LIGHT_GUESS] = str(capture.file), entry.guess
        if entry.standard_error is not None:
            lamp[STATED_ERROR] = entry.standard_error
    list_photos(scene, listed)
    store_found(top, find_up(scan.cameras, scan.mesh))
    return ScanCollection(top, mesh, made, lamps)


def find_earlier_import(scene: bpy.types.Scene, capture: Path) -> bpy.types.Collection | None:
    """The collection of an earlier import of this capture, if it still contains the mesh."""
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
    """Create the cameras and sparse points of a reconstruction without a mesh."""
    own = _own_photos(found.cameras, images, rectified)
    top, camera_collection = _collections(scene, name, ("cameras",))
    centres = np.array([c.pose.centre for c in found.cameras])
    positions = found.points if len(found.points) else centres
    origin = frame_origin(positions)
    centre = np.median(positions, axis=0) - origin
    if len(found.points):
        meshes.create_points_object(f"{name} points", found.points - origin, found.colours, top)
    made = _cameras(found.cameras, own, origin, centre, camera_collection)
    cameras.look_through(scene, next(iter(made.values())))
    store_found(top, find_up(found.cameras))


def _collections(
    scene: bpy.types.Scene, name: str, parts: Sequence[str]
) -> tuple[bpy.types.Collection, ...]:
    """Create a collection and a child collection for every part."""
    top = bpy.data.collections.new(f"Patina {name}")
    scene.collection.children.link(top)
    children = [bpy.data.collections.new(f"{name} {part}") for part in parts]
    for child in children:
        top.children.link(child)
    return (top, *children)


def _cameras(
    found: Sequence[Camera],
    own: dict[str, Path],
    origin: NDArray[np.float64],
    centre: NDArray[np.float64],
    collection: bpy.types.Collection,
) -> dict[str, bpy.types.Object]:
    made = {}
    for camera in found:
        distance = float(np.linalg.norm(camera.pose.centre - origin - centre))
        made[camera.label] = cameras.create_camera(camera, origin, distance, collection)
        if camera.label in own:
            cameras.put_photo_behind(made[camera.label], own[camera.label])
    return made


def _own_photos(found: Sequence[Camera], images: Path | None, rectified: Path) -> dict[str, Path]:
    """Camera label → photo to show, for photos of the scan that are in the folder ``images``."""
    pairs = ((camera, _own_photo(images, camera.label)) for camera in found)
    shown = {}
    for camera, photo in pairs:
        if photo is None:
            continue
        try:
            shown[camera.label] = rectified_photo.photo_for(
                camera.resized(*image_size(photo)), photo, rectified
            )
        except PatinaError as error:
            log.warning("The photo of camera %s cannot be shown: %s", camera.label, error)
    return shown


def _own_photo(images: Path | None, label: str) -> Path | None:
    """The photo of one camera of the scan in the folder ``images``; None if it is not there."""
    if images is None:
        return None
    names = [label, *(f"{label}{suffix}" for suffix in PICTURES)]
    return next((images / name for name in names if (images / name).is_file()), None)
