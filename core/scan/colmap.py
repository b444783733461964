"""COLMAP models, binary or text, old layout or with rigs and frames (pycolmap reads)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from ..errors import InputError
from .camera import Camera, Pose


def is_colmap(folder: Path) -> bool:
    """True for a folder that holds a COLMAP model."""
    return any(
        all((folder / f"{part}.{kind}").is_file() for part in ("cameras", "images"))
        for kind in ("bin", "txt")
    )


def read_points(folder: Path) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """(positions (n, 3) in scan units, sRGB colours (n, 3)) of the sparse points."""
    points = list(_open(folder).points3D.values())
    positions = np.array([point.xyz for point in points], np.float64).reshape(-1, 3)
    return positions, np.array([point.color for point in points], np.uint8).reshape(-1, 3)


def read_colmap(folder: Path) -> tuple[Camera, ...]:
    """All registered cameras of a model folder, sorted by label. Raises InputError."""
    model = _open(folder)
    cameras = []
    for image in model.images.values():
        if not image.has_pose:
            continue
        lens = model.cameras[image.camera_id]
        pose = image.cam_from_world()
        cameras.append(
            Camera(
                label=image.name,
                width=int(lens.width),
                height=int(lens.height),
                model=lens.model.name,
                parameters=tuple(float(p) for p in lens.params),
                pose=Pose(np.array(pose.rotation.matrix()), np.array(pose.translation)),
            )
        )
    if not cameras:
        raise InputError("the COLMAP model has no image with a pose", file=folder)
    return tuple(sorted(cameras, key=lambda camera: camera.label))


def _open(folder: Path) -> pycolmap.Reconstruction:
    try:
        return pycolmap.Reconstruction(str(folder))
    except Exception as error:  # pycolmap raises whatever its parser met
        raise InputError(f"not a readable COLMAP model ({error})", file=folder) from error
