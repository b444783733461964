"""COLMAP models, binary or text, old layout or with rigs and frames (pycolmap reads)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from ..errors import InputError
from .camera import Camera, Pose
from .colmap_check import check_binary_model

# positions (n, 3) in scan units, sRGB colours (n, 3)
Points = tuple[NDArray[np.float64], NDArray[np.uint8]]


def is_colmap(folder: Path) -> bool:
    """True for a folder that holds a COLMAP model."""
    return any(
        all((folder / f"{part}.{kind}").is_file() for part in ("cameras", "images"))
        for kind in ("bin", "txt")
    )


def read_colmap_with_points(folder: Path) -> tuple[tuple[Camera, ...], Points]:
    """(cameras as read_colmap gives them, the sparse points). Raises InputError."""
    model = _open(folder)
    points = list(model.points3D.values())
    positions = np.array([point.xyz for point in points], np.float64).reshape(-1, 3)
    colours = np.array([point.color for point in points], np.uint8).reshape(-1, 3)
    finite = np.isfinite(positions).all(axis=1)
    return _cameras(model, folder), (positions[finite], colours[finite])


def read_colmap(folder: Path) -> tuple[Camera, ...]:
    """All registered cameras of a model folder, sorted by label. Raises InputError."""
    return _cameras(_open(folder), folder)


def _cameras(model: pycolmap.Reconstruction, folder: Path) -> tuple[Camera, ...]:
    cameras: dict[str, Camera] = {}
    for image in model.images.values():
        if not image.has_pose:
            continue
        try:
            label = image.name
        except UnicodeDecodeError as error:
            raise InputError("an image's name is not UTF-8", file=folder) from error
        if label in cameras:
            raise InputError(f"two images are named {label!r}", file=folder)
        lens = model.cameras[image.camera_id]
        pose = image.cam_from_world()
        cameras[label] = Camera(
            label=label,
            width=int(lens.width),
            height=int(lens.height),
            model=lens.model.name,
            parameters=tuple(float(p) for p in lens.params),
            pose=Pose(np.array(pose.rotation.matrix()), np.array(pose.translation)),
        )
    if not cameras:
        raise InputError("the COLMAP model has no image with a pose", file=folder)
    for camera in cameras.values():
        _check(camera, folder)
    return tuple(sorted(cameras.values(), key=lambda camera: camera.label))


def _check(camera: Camera, folder: Path) -> None:
    """Refuse what no camera is; text models reach this unchecked."""
    found = None
    rotation = camera.pose.rotation
    if camera.width <= 0 or camera.height <= 0:
        found = f"is {camera.width} × {camera.height} pixels"
    elif not np.isfinite(camera.parameters).all():
        found = "has parameters that are not finite numbers"
    elif not (np.isfinite(rotation).all() and np.isfinite(camera.pose.translation).all()):
        found = "has a pose that is not made of finite numbers"
    elif not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
        found = "has a rotation that is none"
    elif min(camera.lens.focal_length_x, camera.lens.focal_length_y) <= 1e-6:
        found = f"has a focal length of {camera.lens.focal_length_x:g} pixels"
    if found is not None:
        raise InputError(f"the camera of {camera.label!r} {found}", file=folder)


def _open(folder: Path) -> pycolmap.Reconstruction:
    if (folder / "cameras.bin").is_file():  # what pycolmap prefers where there are both
        check_binary_model(folder)
    try:
        return pycolmap.Reconstruction(str(folder))
    except Exception as error:  # pycolmap raises whatever its parser met
        raise InputError(f"not a readable COLMAP model ({error})", file=folder) from error
