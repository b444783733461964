"""Photograph the object: Cycles, the exact bunny of the reference data, direct light of one sun.

The capture file gets the mesh that a stereo tool made of other pictures of the same bunny, and
cameras that are turned by as much as those of a scan are off.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from patina.core.photo.image import write_exr
from patina.core.scan import Camera as ScanCamera

from ..demo_render import Camera, Studio
from ..demo_shape import Surface, vertex_normals
from ..experiments.bunnies import folder as scan_folder
from ..experiments.bunnies import opened, true_bunny
from .coat import coated
from .finish import finish_of

SCAN = "OpenMVS"  # the stereo tool of the mesh
SIZE = (600, 420)  # of the photos, pixels
SCAN_WIDTH = 1000  # of the scan's photos, pixels
SAMPLES = 16  # rays a pixel
IRRADIANCE = float(np.pi)
POSE_ERROR = 0.3  # pixels of the scan's photos, by which the cameras of the capture are turned
NOISE = 0.01  # relative, and of the median radiance, of the photos
ANGLES = (20.0, 45.0, 70.0, 100.0)  # degrees between the lamps and the views, in turn


@dataclass(frozen=True)
class Shot:
    """One photo: its camera, and the direction from the surface to the sun."""

    camera: ScanCamera
    light: NDArray[np.float64]


def shots(count: int, seed: int = 7) -> list[Shot]:
    """``count`` photos from the cameras of the scan in a random order, each with its own sun."""
    rng = np.random.default_rng(seed)
    _, scan, _ = opened(SCAN)
    cameras = sorted(scan.cameras, key=lambda camera: camera.label)
    rounds = -(-count // len(cameras))
    order = np.concatenate(
        [np.random.default_rng((seed, k)).permutation(len(cameras)) for k in range(rounds)]
    )
    middle = true_bunny().vertices.mean(axis=0)
    found = []
    for place in range(count):
        camera = cameras[order[place]].resized(*SIZE)
        view = camera.pose.centre - middle
        view /= np.linalg.norm(view)
        across = np.cross(view, rng.normal(size=3))
        across /= np.linalg.norm(across)
        angle = np.radians(ANGLES[place % len(ANGLES)])
        found.append(Shot(camera, np.cos(angle) * view + np.sin(angle) * across))
    return found


def photograph(folder: Path, count: int) -> Path:
    """Render ``count`` photos into a folder; return the capture file."""
    taken = shots(count)
    studio = _studio()
    rng = np.random.default_rng(3)
    for place, shot in enumerate(taken):
        studio.light(shot.light, IRRADIANCE)
        pixels = studio.photograph(_pinhole(shot.camera))[..., :3]
        level = float(np.median(pixels[pixels > 0]))
        pixels *= 1 + NOISE * rng.normal(size=pixels.shape)
        pixels += NOISE * level * rng.normal(size=pixels.shape)
        write_exr(folder / f"{place:03d}.exr", pixels, half=True)
    return _write_capture(folder, taken)


def _studio() -> Studio:
    mesh = true_bunny()
    studio = Studio(SAMPLES)
    normals = vertex_normals(mesh.vertices, mesh.faces)
    studio.show(Surface(mesh.vertices, mesh.faces, normals), np.zeros(len(mesh.vertices)))
    studio.dress(coated(studio.body, finish_of(mesh.vertices)))
    return studio


def _pinhole(camera: ScanCamera) -> Camera:
    focal, x, y = camera.parameters[:3]
    pose = camera.pose
    return Camera(pose.rotation, pose.translation, focal, (x, y), (camera.width, camera.height))


def _write_capture(folder: Path, taken: list[Shot]) -> Path:
    """Cameras in COLMAP's format, each photo with its own, and the capture file."""
    rng = np.random.default_rng(5)
    model = pycolmap.Reconstruction()
    lines = ["[scan]", 'cameras = "sparse"']
    lines += [f'mesh = "{(scan_folder(SCAN) / "mesh.ply").resolve()}"']
    photos = []
    for place, shot in enumerate(taken):
        pinhole, name = _pinhole(shot.camera), f"view_{place:03d}.jpg"
        wrong = rng.normal(size=3) * POSE_ERROR / pinhole.focal / (SCAN_WIDTH / SIZE[0])
        turn = pycolmap.Rotation3d(wrong)
        pose = pycolmap.Rigid3d(
            turn * pycolmap.Rotation3d(pinhole.rotation), turn * pinhole.translation
        )
        lens = pycolmap.Camera(
            model="SIMPLE_PINHOLE", width=SIZE[0], height=SIZE[1],
            params=[pinhole.focal, *pinhole.centre], camera_id=place + 1,
        )  # fmt: skip
        model.add_camera_with_trivial_rig(lens)
        image = pycolmap.Image(name=name, camera_id=place + 1, image_id=place + 1)
        model.add_image_with_trivial_frame(image, pose)
        direction = ", ".join(f"{x:.12g}" for x in shot.light)
        lines += ["[[light]]", f'name = "sun{place}"', f"direction = [{direction}]"]
        lines += [f"irradiance = [{IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}]"]
        photos += ["[[photo]]", f'file = "{place:03d}.exr"', f'camera = "{name}"']
        photos += [f'light = "sun{place}"']
    (folder / "sparse").mkdir(exist_ok=True)
    model.write_binary(str(folder / "sparse"))
    path = folder / "object.capture.toml"
    path.write_text("\n".join([*lines, *photos]) + "\n")
    return path
