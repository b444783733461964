"""Reader for COLMAP models, binary or text, old layout or with rigs and frames (through
pycolmap)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pycolmap

from ...errors import InputError
from ..camera import Camera, Pose
from ..reconstruction import Reconstruction, reconstruction_of
from .colmap_check import check_binary_model


def is_colmap(folder: Path) -> bool:
    """True for a folder that holds a COLMAP model."""
    return any(
        all((folder / f"{part}.{kind}").is_file() for part in ("cameras", "images"))
        for kind in ("bin", "txt")
    )


def read_colmap(folder: Path) -> Reconstruction:
    """All registered cameras of a model folder, and its points. Raises InputError."""
    model = _open(folder)
    points = list(model.points3D.values())
    positions = np.array([point.xyz for point in points], np.float64).reshape(-1, 3)
    colours = np.array([point.color for point in points], np.uint8).reshape(-1, 3)
    finite = np.isfinite(positions).all(axis=1)
    cameras, unplaced = _cameras(model, folder)
    return reconstruction_of(
        cameras, folder, points=positions[finite], colours=colours[finite],
        notes=(f"Images without a pose that were left out: {unplaced}.",) if unplaced else (),
    )  # fmt: skip


def _cameras(model: pycolmap.Reconstruction, folder: Path) -> tuple[list[Camera], int]:
    """(cameras with a pose, number of images without a pose)."""
    cameras: list[Camera] = []
    unplaced = 0
    for image in model.images.values():
        if not image.has_pose:
            unplaced += 1
            continue
        try:
            label = image.name
        except UnicodeDecodeError as error:
            raise InputError("the name of an image is not UTF-8", file=folder) from error
        lens = model.cameras[image.camera_id]
        pose = image.cam_from_world()
        camera = Camera(
            label=label,
            width=int(lens.width),
            height=int(lens.height),
            model=lens.model.name,
            parameters=tuple(float(p) for p in lens.params),
            pose=Pose(np.array(pose.rotation.matrix()), np.array(pose.translation)),
            photo=label,
        )
        cameras.append(camera)
    return cameras, unplaced


def _open(folder: Path) -> pycolmap.Reconstruction:
    if (folder / "cameras.bin").is_file():  # pycolmap prefers the binary model where both exist
        check_binary_model(folder)
    try:
        return pycolmap.Reconstruction(str(folder))
    except Exception as error:  # pycolmap raises many types of exception
        raise InputError(f"is not a readable COLMAP model ({error})", file=folder) from error
