"""A capture as a Blender collection: mesh, cameras with their photos, lights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..core.capture import Capture
from ..core.scan import Scan
from . import cameras, lights, meshes, photos
from .frame import frame_origin

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
    top = bpy.data.collections.new(f"Patina {name}")
    scene.collection.children.link(top)
    camera_room = bpy.data.collections.new(f"{name} cameras")
    light_room = bpy.data.collections.new(f"{name} lights")
    top.children.link(camera_room)
    top.children.link(light_room)

    origin = frame_origin(scan.mesh)
    mesh = meshes.create_mesh_object(name, scan.mesh, origin, top)
    used = scan.mesh.vertices[np.unique(scan.mesh.faces)]
    centre = 0.5 * (used.min(axis=0) + used.max(axis=0)) - origin
    made = {}
    for camera in scan.cameras:
        distance = float(np.linalg.norm(camera.pose.centre - origin - centre))
        made[camera.label] = cameras.create_camera(camera, origin, distance, camera_room)
        own = _own_photo(scan, camera.label)
        if own is not None:
            shown = photos.photo_for(camera, own, rectified)
            cameras.put_photo_behind(made[camera.label], shown)
    for photo in capture.photos:
        camera = scan.camera(photo.camera)
        if camera is not None:
            shown = photos.photo_for(camera, photo.file, rectified)
            cameras.put_photo_behind(made[camera.label], shown)
            made[camera.label]["patina_lit"] = photo.file.name
    suns = {
        light.name: lights.create_sun(light, centre, scan.mesh.size, light_room)
        for light in capture.lights
    }
    for other in list(suns.values())[1:]:  # one light at a time, as the photos were taken
        other.hide_render = True
        other.hide_set(True)
    if capture.photos:
        first = scan.camera(capture.photos[0].camera)
        if first is not None:
            cameras.look_through(scene, made[first.label])
    elif made:
        cameras.look_through(scene, next(iter(made.values())))
    return ScanCollection(top, mesh, made, suns)


def _own_photo(scan: Scan, label: str) -> Path | None:
    """The scan's own photo of a camera, where the capture says where the photos lie."""
    if scan.images is None:
        return None
    exact = scan.images / label
    if exact.is_file():
        return exact
    return next(
        (p for s in PICTURES if (p := scan.images / f"{label}{s}").is_file()),
        None,
    )
