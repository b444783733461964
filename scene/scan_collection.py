"""A capture as a Blender collection: mesh, cameras with their photos, lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.capture import Capture
from ..core.scan import Camera, Scan
from . import cameras, lights, meshes, photos
from .frame import frame_origin
from .properties import CAPTURE

PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr")


@dataclass(frozen=True)
class ScanCollection:
    """What was made. cameras: label → object; lights: name → object."""

    collection: bpy.types.Collection
    mesh: bpy.types.Object
    cameras: dict[str, bpy.types.Object]
    lights: dict[str, bpy.types.Object]


def create_scan_collection(
    scene: bpy.types.Scene, capture: Capture, scan: Scan, rectified: Path
) -> ScanCollection:
    """Everything of a capture, linked into ``scene``; call only when all of it has been parsed.

    rectified: folder for resampled photos of distorted lenses.
    """
    name = capture.file.name.removesuffix(".toml").removesuffix(".capture")
    # photos first: one that cannot be read must leave nothing behind
    own = _own_photos(scan.cameras, scan.images, rectified)
    lit = []
    for photo in capture.photos:
        camera = scan.camera(photo.camera)
        if camera is not None:
            shown = photos.photo_for(camera, photo.file, rectified)
            lit.append((camera.label, shown, photo))
    top, camera_room, light_room = _rooms(scene, name, ("cameras", "lights"))
    top[CAPTURE] = str(capture.file)
    used = scan.mesh.vertices[np.unique(scan.mesh.faces)]
    origin = frame_origin(used)
    centre = 0.5 * (used.min(axis=0) + used.max(axis=0)) - origin
    mesh = meshes.create_mesh_object(name, scan.mesh, origin, top)
    made = _cameras(scan.cameras, own, origin, centre, camera_room)
    for place, (label, shown, photo) in enumerate(lit):
        cameras.put_photo_behind(made[label], shown)
        made[label]["patina_lit"] = photo.file.name
        made[label]["patina_place"] = place
        made[label]["patina_light"] = photo.light
        made[label][CAPTURE] = str(capture.file)
    suns = {
        light.name: lights.create_sun(light, centre, scan.mesh.size, light_room)
        for light in capture.lights
    }
    for sun in suns.values():
        sun[CAPTURE] = str(capture.file)
    first = scan.camera(capture.photos[0].camera)
    if first is not None:
        cameras.look_through(scene, made[first.label])
        lights.shine_only(scene, made[first.label])
    return ScanCollection(top, mesh, made, suns)


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
    found: Sequence[Camera],
    points: tuple[NDArray[np.float64], NDArray[np.uint8]],
    images: Path | None,
    rectified: Path,
) -> None:
    """A reconstruction without a mesh: its cameras and its sparse points."""
    own = _own_photos(found, images, rectified)
    top, camera_room = _rooms(scene, name, ("cameras",))
    positions = points[0] if len(points[0]) else np.array([c.pose.centre for c in found])
    origin = frame_origin(positions)
    centre = np.median(positions, axis=0) - origin
    if len(points[0]):
        meshes.create_points_object(f"{name} points", points[0] - origin, points[1], top)
    made = _cameras(found, own, origin, centre, camera_room)
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
    return {
        camera.label: photos.photo_for(camera, photo, rectified)
        for camera, photo in there
        if photo is not None
    }


def _own_photo(images: Path | None, label: str) -> Path | None:
    """The scan's own photo of a camera, where it is known where the photos lie."""
    if images is None:
        return None
    names = [label, *(f"{label}{suffix}" for suffix in PICTURES)]
    return next((images / name for name in names if (images / name).is_file()), None)
