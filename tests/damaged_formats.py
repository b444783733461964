"""Valid files of every format to damage, and checks of what is read from damaged files."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from patina.core.errors import InputError
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.reconstruction import Reconstruction
from tests import make_reconstructions as made
from tests.make_points_scene import FOCAL, HEIGHT, WIDTH, Scene, make_scene

MAX_SECONDS = 5.0  # of reading a file
MILLIMETRES = {
    "type": "brown", "sensorWidth": 36.0, "focalLength": 39.4, "pixelRatio": 1.0,
    "principalPoint": [3.0, 4.0], "distortionParams": [0.1, 0.01, 0.0, 0.001, 0.002],
}  # fmt: skip
PIXELS = {"fl_x": FOCAL, "fl_y": FOCAL, "cx": 320.0, "cy": 240.0, "w": WIDTH, "h": HEIGHT,
          "k1": 0.1, "applied_scale": 2.0, "camera_model": "OPENCV"}  # fmt: skip
BROWN_T2 = {"focal_length": FOCAL, "principal_point": [320.0, 240.0],
            "disto_t2": [0.1, 0.0, 0.0, 0.0, 0.001]}  # fmt: skip
SFM_BROWN = {"projection_type": "brown", "focal_x": 1.1, "focal_y": 1.1, "c_x": 0.01, "c_y": 0.0,
             "k1": 0.1}  # fmt: skip

Writer = Callable[[Path, Scene], object]
WRITERS: dict[str, Writer] = {
    "bundle.out": lambda path, scene: made.write_bundler(path, scene, 0.1, -0.05),
    "model.nvm": lambda path, scene: made.write_nvm(path, scene, 0.1),
    "cameras.sfm": lambda path, scene: made.write_meshroom(path, scene, MILLIMETRES),
    "transforms.json": lambda path, scene: made.write_transforms(path, scene, PIXELS),
    "sfm_data.json": lambda path, scene: made.write_openmvg(
        path, scene, "pinhole_brown_t2", BROWN_T2
    ),
    "reconstruction.json": lambda path, scene: made.write_opensfm(path, scene, SFM_BROWN),
    "cameras.csv": lambda path, scene: made.write_realityscan_csv(
        path, scene, (0.1, 0.0, 0.0, 0.0, 0.0, 0.0), (0.01, 0.0)
    ),
    "IMG_0003.xmp": lambda path, scene: made.write_realityscan_xmp(
        path.parent, scene, "brown3", (0.1, 0.0, 0.0, 0.0, 0.0, 0.0), (0.01, 0.0)
    ),
}
NAMES = tuple(WRITERS)
JSONS = ("cameras.sfm", "transforms.json", "sfm_data.json", "reconstruction.json")


def write_all(folder: Path) -> Path:
    """Write a valid file of each format, with photos."""
    scene = make_scene(12)
    made.write_photos(folder / "photos", scene)
    for name, write in WRITERS.items():
        write(folder / name, scene)
    return folder


def read(path: Path, images: Path | None = None) -> Reconstruction | InputError:
    """Return the content or the InputError; fails for warnings and other exceptions."""
    began = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found: Reconstruction | InputError = read_reconstruction(path, images)
    except InputError as error:
        assert "\n" not in str(error) and len(str(error)) < 600
        found = error
    assert time.perf_counter() - began < MAX_SECONDS
    return found


def check_sound(found: Reconstruction | InputError) -> None:
    """Check that the cameras are valid, if the file was read."""
    if isinstance(found, InputError):
        return
    assert found.cameras
    assert len({camera.label for camera in found.cameras}) == len(found.cameras)
    for camera in found.cameras:
        turn = camera.pose.rotation
        assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-3) and np.linalg.det(turn) > 0
        assert np.isfinite(camera.pose.translation).all() and np.isfinite(camera.parameters).all()
        assert camera.panoramic or camera.lens.focal_length_x > 0
    assert np.isfinite(found.points).all() and len(found.points) == len(found.colours)


def damaged(whole: Path, folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    if name == "bundle.out":
        (folder / "list.txt").write_bytes((whole / "list.txt").read_bytes())
    return path


def refused(path: Path, *words: str, images: Path | None = None) -> str:
    found = read(path, images)
    assert isinstance(found, InputError), "was read"
    for word in words:
        assert word in str(found), str(found)
    return str(found)
