"""Reader for Meshroom's (AliceVision's) .sfm and .json.

AliceVision, src/aliceVision/sfmDataIO/jsonIO.cpp and src/aliceVision/camera. Poses are world →
camera (x right, y down, z forward); the rotation is stored column by column, with a centre. The
principal point is relative to the photo's centre since version 1.2.1. The focal length is in
millimetres of the sensor since 1.2.2: that of x, with pixelRatio fx/fy until 1.2.4 and fy/fx since
1.2.5; that of y since 1.2.11 (found in the files of one scene that AliceVision keeps of each
version, compatibilityData). The photo's centre is at half its size in pixels, as in AliceVision's
own export to COLMAP.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..lenses.brown import Lens, brown_lens, fisheye_lens, panorama_lens
from ..parsing.json_file import read_json
from ..parsing.json_record import Record, root_record
from ..parsing.photo_labels import labels_of
from ..parsing.sparse import sparse_points
from ..reconstruction import Reconstruction, reconstruction_of

Array = NDArray[np.float64]

# In older files the type also names the distortion: type → (projection, distortion)
TYPES = {
    "pinhole": ("pinhole", "none"),
    "radial1": ("pinhole", "radialk1"),
    "radial3": ("pinhole", "radialk3"),
    "brown": ("pinhole", "brown"),
    "fisheye4": ("pinhole", "fisheye4"),
    "fisheye1": ("pinhole", "fisheye1"),
    "equidistant": ("equidistant", "none"),
    "equidistant_r3": ("equidistant", "radialk3pt"),
    "equirectangular": ("equirectangular", "none"),
}
PARAMETER_COUNTS = {
    "none": 0, "radialk1": 1, "radialk3": 3, "radialk3pt": 3, "brown": 5, "fisheye4": 4,
    "fisheye1": 1,
}  # fmt: skip
DEFAULT_SENSOR = 36.0, 24.0  # width and height in mm, where the file gives none


def read_meshroom(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras and points of an .sfm. Raises InputError."""
    if chunk is not None:
        raise InputError("Meshroom's files have no chunks", file=path, key="scan.chunk")
    data = root_record(read_json(path), path)
    version = _version(data)
    poses = {record.identity("poseId"): record for record in data.records("poses")}
    rigs = {record.identity("rigId"): record for record in data.records("rigs")}
    intrinsics = {record.identity("intrinsicId"): record for record in data.records("intrinsics")}
    views = data.records("views")
    labels = labels_of([view.text("path") for view in views], path)
    cameras = []
    lenses: dict[str, tuple[int, int, str, tuple[float, ...]]] = {}  # of those that are used
    for label, view in zip(labels, views, strict=True):
        pose = _pose(view, poses, rigs)
        key = view.identity("intrinsicId")
        if pose is None or key not in intrinsics:
            continue
        if key not in lenses:
            lenses[key] = _intrinsic(intrinsics[key], version)
        cameras.append(Camera(label, *lenses[key], pose, view.text("path")))
    notes = []
    if len(cameras) < len(views):
        notes.append(
            f"Photos without a pose or a lens that were left out: {len(views) - len(cameras)}."
        )
    if not poses:
        raise InputError(
            f"holds {len(views)} photos and no pose: it was written before "
            "StructureFromMotion ran; "
            "that node writes sfm.abc, which ConvertSfMFormat converts to .sfm",
            file=path,
        )
    points, colours, more = sparse_points(
        data.table("structure", "X", 3), data.table("structure", "color", 3)
    )
    return reconstruction_of(cameras, path, points=points, colours=colours, notes=(*notes, *more))


def _version(data: Record) -> tuple[int, ...]:
    """Version of the file's format, 1.0.0 where it is missing."""
    return tuple(int(v) for v in data.numbers("version", 3, default=np.array([1.0, 0.0, 0.0])))


def _intrinsic(record: Record, version: tuple[int, ...]) -> tuple[int, int, str, tuple[float, ...]]:
    """(width, height, model, parameters)."""
    width, height = record.whole("width"), record.whole("height")
    if not (width and height):
        raise record.error("is 0; expected the photo's size in pixels", "width")
    kind = record.text("type").lower()
    projection, distortion = TYPES.get(kind, (kind, ""))
    distortion = record.text("distortionType", distortion).lower()
    distortion = {"fisheye": "fisheye4"}.get(distortion, distortion)
    if projection not in ("pinhole", "equidistant", "equirectangular") or (
        distortion not in PARAMETER_COUNTS
    ):
        raise record.error(
            f"the lens {kind!r}{f' with {distortion!r}' if distortion else ''} is not supported; "
            f"expected {', '.join(TYPES)}; or undistort the photos in Meshroom and use those",
            "type",
        )
    fx, fy = _focal(record, version, width, height)
    cx, cy = record.numbers("principalPoint", 2, default=np.zeros(2))
    if version >= (1, 2, 1) or "principalPoint" not in record:
        cx, cy = cx + width / 2, cy + height / 2
    if projection == "equirectangular":
        return width, height, *_panorama(record, (fx, fy, cx, cy), width, height)
    parameters = _distortion(record, distortion)
    if _undistortion(record):
        raise record.error(
            "is a 3DEqualizer calibration, which is not supported", "undistortionParams"
        )
    if projection == "pinhole":
        return width, height, *_pinhole(distortion, parameters, fx, fy, cx, cy)
    return width, height, *_equidistant(record, distortion, parameters, fx, cx, cy)


def _focal(
    record: Record, version: tuple[int, ...], width: int, height: int
) -> tuple[float, float]:
    """fx and fy in pixels."""
    if "pxFocalLength" in record and not isinstance(record.values["pxFocalLength"], list):
        focal = record.number("pxFocalLength")
        return focal, focal
    if "pxFocalLength" in record:
        both = record.numbers("pxFocalLength", 2)
        return float(both[0]), float(both[1])
    sensor = record.number("sensorWidth", DEFAULT_SENSOR[0])
    if sensor <= 0:
        raise record.error(f"is {sensor:g} mm; expected a positive number", "sensorWidth")
    focal = record.number("focalLength") / sensor * width
    ratio = record.number("pixelRatio", 1.0)
    if ratio <= 0:
        raise record.error(f"is {ratio:g}; expected a positive number", "pixelRatio")
    if version < (1, 2, 5):
        return focal, focal / ratio
    if version < (1, 2, 9) or ratio == 1:
        return focal, focal * ratio
    if version < (1, 2, 11):
        raise record.error(
            f"is {ratio:g}: its meaning in version {'.'.join(map(str, version))} of the format "
            "is not known; save the scene with a newer Meshroom",
            "pixelRatio",
        )
    return focal / ratio, focal


def _distortion(record: Record, distortion: str) -> list[float]:
    """The distortion coefficients; zeros where the file holds none or ""."""
    count = PARAMETER_COUNTS[distortion]
    for key in ("distortionParams", "distortionCoefficients"):
        if record.values.get(key) not in (None, "", []):
            values = record.numbers(key, count, *(range(9) if count == 0 else ()))
            return [float(v) for v in values[:count]]
    return [0.0] * count


def _undistortion(record: Record) -> bool:
    return record.values.get("undistortionParams") not in (None, "", []) and record.values.get(
        "undistortionType", "none"
    ) not in ("none", None)


def _pinhole(
    distortion: str, parameters: list[float], fx: float, fy: float, cx: float, cy: float
) -> Lens:
    if distortion == "fisheye4":
        return fisheye_lens(fx, fy, cx, cy, parameters)
    if distortion == "fisheye1":
        if parameters[0] == 0.0:
            return brown_lens(fx, fy, cx, cy)
        return "FOV", (fx, fy, cx, cy, parameters[0])
    if distortion == "brown":
        return brown_lens(fx, fy, cx, cy, parameters[:3], parameters[3:])
    if distortion == "radialk3pt":  # the polynomial is divided by its value at r = 1
        total = 1.0 + sum(parameters)
        if total <= 0:
            total = np.nan
        return brown_lens(fx / total, fy / total, cx, cy, parameters)
    return brown_lens(fx, fy, cx, cy, parameters)


def _equidistant(
    record: Record, distortion: str, parameters: list[float], fx: float, cx: float, cy: float
) -> Lens:
    """AliceVision's Equidistant model: θ divided by half the field of view, times the radius of the
    fisheye's circle. The distortion acts on that quotient."""
    width, height = record.whole("width"), record.whole("height")
    sensor_width = record.number("sensorWidth", DEFAULT_SENSOR[0])
    sensor_height = record.number("sensorHeight", DEFAULT_SENSOR[1])
    radius = record.number("fisheyeCircleRadius", min(width, height) / 2)
    if distortion not in ("none", "radialk3", "radialk3pt"):
        raise record.error(f"the lens equidistant with {distortion!r} is not supported", "type")
    if min(sensor_width, sensor_height, radius, fx) <= 0:
        raise record.error("has a size, a focal length or a fisheye circle that is not positive")
    focal = fx * sensor_width / max(width, height)  # mm
    half = 0.5 * min(sensor_width, sensor_height) / focal  # radians
    scale = radius / half
    if distortion == "radialk3pt":
        total = 1.0 + sum(parameters)
        scale = scale / total if total > 0 else np.nan
    within = [k / half ** (2 * (i + 1)) for i, k in enumerate(parameters)]
    return fisheye_lens(scale, scale, cx, cy, within)


def _panorama(record: Record, lens: tuple[float, ...], width: int, height: int) -> Lens:
    """AliceVision's Equirectangular model: fx and fy are pixels per radian."""
    whole = width / (2 * np.pi), width / (2 * np.pi), width / 2, height / 2
    if width != 2 * height or not np.allclose(lens, whole, rtol=1e-3, atol=0.5):
        raise record.error(
            "is a panorama of a part of the sphere, which is not supported; expected the "
            "whole sphere",
            "type",
        )
    return panorama_lens(width, height)


def _pose(view: Record, poses: dict[str, Record], rigs: dict[str, Record]) -> Pose | None:
    """World → camera. For a camera of a rig: the rig's pose combined with the camera's pose in the
    rig."""
    record = poses.get(view.identity("poseId"))
    if record is None:
        return None
    pose = _transform(record.record("pose").record("transform"))
    rig = rigs.get(view.identity("rigId"))
    if rig is None or ("isPoseIndependant" in view and view.flag("isPoseIndependant")):
        return pose
    places = rig.records("subPoses")
    index = view.whole("subPoseId", 0)
    if index >= len(places):
        raise view.error(f"is {index}; the rig has {len(places)} cameras", "subPoseId")
    if places[index].text("status", "constant") == "uninitialized":
        return None
    place = _transform(places[index].record("pose"))
    return Pose(
        place.rotation @ pose.rotation, place.rotation @ pose.translation + place.translation
    )


def _transform(record: Record) -> Pose:
    rotation = record.numbers("rotation", 9).reshape(3, 3).T  # written column by column
    return Pose(rotation, -rotation @ record.numbers("center", 3))
