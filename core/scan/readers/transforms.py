"""Reader for transforms.json of instant-ngp and nerfstudio.

instant-ngp, docs/nerf_dataset_tips.md; nerfstudio, docs "Data conventions". transform_matrix is
camera → world with x right, y up, z back. Intrinsics are given for all frames or for each. Pixels
are counted as in COLMAP. k4 of a camera that is not a fisheye is the coefficient of r⁸ (not
OpenCV's k4).
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..lenses.brown import Lens, brown_lens, fisheye_lens, panorama_lens
from ..parsing.json_file import read_json
from ..parsing.json_record import Record, root_record
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..reconstruction import Reconstruction, Similarity, reconstruction_of

Array = NDArray[np.float64]

AXES_FLIP = np.diag([1.0, -1.0, -1.0])  # x right, y up, z back → x right, y down, z forward
BROWN = {"OPENCV", "FULL_OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", ""}
FISHEYE = {"OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "FISHEYE"}
PANORAMA = {"EQUIRECTANGULAR"}


def read_transforms(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras of a transforms.json. Raises InputError."""
    if chunk is not None:
        raise InputError("transforms.json has no chunks", file=path, key="scan.chunk")
    data = root_record(read_json(path), path)
    frames = data.records("frames")
    names = [frame.text("file_path") for frame in frames]
    labels = labels_of(names, path)
    photos = PhotoSizes(images, path.parent)
    cameras = []
    for label, name, frame in zip(labels, names, frames, strict=True):
        # a frame's own values override the common ones
        own = Record({**data.values, **frame.values}, path, frame.where)
        width, height = _size(own, name, photos)
        lens = _lens(own, width, height)
        cameras.append(Camera(label, width, height, *lens, _pose(frame), name))
    frames_of = _frames(data)
    notes = ("The sparse points are in another file (ply_file_path), which was not read.",)
    return reconstruction_of(
        cameras, path, frames=frames_of, notes=notes * ("ply_file_path" in data)
    )


def _size(record: Record, name: str, photos: PhotoSizes) -> tuple[int, int]:
    width, height = record.whole("w", 0), record.whole("h", 0)
    if width and height:
        return width, height
    size = photos.size(name)
    if size is None:
        raise record.error(
            f"is missing, and the photo {name[:60]!r} was not found; "
            "set [scan] images to the folder of the photos",
            "w",
        )
    return size


def _lens(record: Record, width: int, height: int) -> Lens:
    model = record.text("camera_model", "").upper()
    fisheye = model in FISHEYE or record.flag("is_fisheye")
    for key in ("ftheta_p0", "latlong", "rolling_shutter"):
        if record.values.get(key) not in (None, False, 0, [0, 0, 0, 0]):
            raise record.error(
                "is a camera model of instant-ngp's own, which is not supported", key
            )
    if model in PANORAMA:
        if width != 2 * height:
            raise record.error(
                "is a panorama that is not twice as wide as high, which is not supported", "w"
            )
        return panorama_lens(width, height)
    if model not in BROWN | FISHEYE:
        known = ", ".join(sorted((BROWN | FISHEYE | PANORAMA) - {""}))
        raise record.error(
            f"the lens {model[:40]!r} is not supported; expected one of {known}", "camera_model"
        )
    fx, fy = _focal(record, width, height)
    cx, cy = record.number("cx", width / 2), record.number("cy", height / 2)
    radial = [record.number(f"k{i}", 0.0) for i in (1, 2, 3, 4)]
    tangential = record.number("p1", 0.0), record.number("p2", 0.0)
    if fisheye:
        if any(tangential):
            raise record.error(
                "is not 0 for a fisheye, where no tool defines its meaning; expected 0", "p1"
            )
        return fisheye_lens(fx, fy, cx, cy, radial)
    if model == "FULL_OPENCV":
        k = [record.number(f"k{i}", 0.0) for i in range(1, 7)]
        return "FULL_OPENCV", (fx, fy, cx, cy, k[0], k[1], *tangential, *k[2:])
    if model in ("PINHOLE", "SIMPLE_PINHOLE"):
        return brown_lens(fx, fy, cx, cy)
    return brown_lens(fx, fy, cx, cy, radial, tangential)


def _focal(record: Record, width: int, height: int) -> tuple[float, float]:
    """(fx, fy) in pixels, from focal lengths or from angles of view."""
    focals = []
    for key, angle, size in (("fl_x", "camera_angle_x", width), ("fl_y", "camera_angle_y", height)):
        if key in record:
            focals.append(record.number(key))
        elif angle in record and not (focals and "fl_x" in record):
            view = record.number(angle)
            if not 0 < view < math.pi:
                raise record.error(f"is {view:g}; expected an angle between 0 and π", angle)
            focals.append(size / 2 / math.tan(view / 2))
    if not focals:
        raise record.error("is missing; expected fl_x or camera_angle_x", "fl_x")
    return focals[0], focals[-1]


def _pose(frame: Record) -> Pose:
    """World → camera. A scale in the matrix, which some exports of Blender contain, is ignored."""
    try:
        placed = Similarity.of_matrix(_matrix(frame, "transform_matrix"))
    except ValueError as error:
        raise frame.error(f"is not a pose: {error}", "transform_matrix") from error
    rotation = AXES_FLIP @ placed.rotation.T
    return Pose(rotation, -rotation @ placed.translation)


def _matrix(record: Record, key: str) -> Array:
    """4 × 4 matrix, written with or without its last row."""
    values = record.numbers(key, 12, 16)
    return np.vstack([values.reshape(-1, 4)[:3], values[12:] if len(values) == 16 else LAST_ROW])


LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])


def _frames(data: Record) -> dict[str, Similarity]:
    """The frame before nerfstudio's applied_transform and applied_scale: that of the original
    reconstruction and of a mesh made from it."""
    if "applied_transform" not in data and "applied_scale" not in data:
        return {}
    matrix = np.eye(4)
    if "applied_transform" in data:
        matrix = _matrix(data, "applied_transform")
    scale = data.number("applied_scale", 1.0)
    if scale <= 0:
        raise data.error(f"is {scale:g}; expected a positive number", "applied_scale")
    try:
        applied = Similarity.of_matrix(matrix)
    except ValueError as error:
        raise data.error(f"is not a similarity: {error}", "applied_transform") from error
    back = applied.rotation.T / applied.scale
    original = Similarity(
        applied.rotation.T, -back @ applied.translation, 1 / (scale * applied.scale)
    )
    return {"original": original}
