"""Three scanned bunnies of the reference data: real reconstruction errors, known truth."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from patina.core.capture import Capture, read_capture
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.light import DistantLight
from patina.core.scan import Camera, Mesh, Scan
from patina.core.scan.mesh import read_mesh

from .materials import data_folder
from .simulate import Shot

BUNNIES = {
    "OpenMVS": "bunny_red",
    "OpenMVS refined": "bunny_bronze",
    "MVE": "bunny_fabric",
}
"""Stereo tool → the capture whose mesh it made."""


def folder(tool: str) -> Path:
    """Return the folder of the capture."""
    return data_folder() / "scans" / BUNNIES[tool]


@lru_cache(maxsize=1)
def true_bunny() -> Mesh:
    """Return the exact surface, in the frame of the scans."""
    return read_mesh(data_folder() / "scans" / "bunny_truth.ply")


@lru_cache(maxsize=3)
def opened(tool: str) -> tuple[Capture, Scan, tuple[Shot, ...]]:
    """Return the capture as Patina reads it, its scan and its eight shots."""
    capture = read_capture(folder(tool) / "scan.capture.toml")
    scan = capture_data.open_scan(capture)
    lights = find_lights(capture, scan, LitPhotos.open(capture))
    shots = []
    for place in range(len(capture.photos)):
        light = lights.of(capture, place)
        if not isinstance(light, DistantLight):
            raise TypeError("the bunnies' lights are distant")
        shots.append(Shot(capture_data.camera_of(capture, scan, place), light))
    return capture, scan, tuple(shots)


def other_cameras(tool: str) -> list[Camera]:
    """Return the cameras of the scan that are not cameras of the eight lit photos."""
    _, scan, shots = opened(tool)
    used = {shot.camera.label for shot in shots}
    size = (shots[0].camera.width, shots[0].camera.height)
    others = [camera for camera in scan.cameras if camera.label not in used]
    return [camera.resized(*size) for camera in sorted(others, key=lambda c: c.label)]
