"""Reader for OpenSfM's reconstruction.json (also OpenDroneMap's).

OpenSfM, doc "Reconstruction file format" and "Geometric models". A shot's rotation is a rotation
vector (axis times angle), world → camera (x right, y down, z forward), with a translation. Focal
lengths and the principal point are in units of the photo's larger side; the principal point is
relative to its centre. The world is metres east, north and up of reference_lla.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..lenses.brown import Lens, brown_lens, fisheye_lens, panorama_lens
from ..parsing.json_file import read_json
from ..parsing.json_record import Record
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..parsing.sparse import sparse_points
from ..reconstruction import Georeference, Reconstruction, reconstruction_of

Array = NDArray[np.float64]

KINDS = (
    "perspective", "brown", "radial", "simple_radial", "fisheye", "fisheye_opencv", "fisheye62",
    "spherical",
)  # fmt: skip
PANORAMAS = ("spherical", "equirectangular")


def read_opensfm(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras and points of a reconstruction.json. chunk: number of the reconstruction ("1", "2"
    …); without it the one with the most photos. Raises InputError."""
    data = read_json(path)
    listed = data if isinstance(data, list) else [data]
    parts = Record({"reconstructions": listed}, path).records("reconstructions")
    parts = [Record(part.values, path, part.where if len(parts) > 1 else "") for part in parts]
    if not parts:
        raise InputError("holds no reconstruction", file=path)
    selected, notes = _selected(parts, chunk, path)
    cameras = dict(selected.items("cameras"))
    shots = list(selected.items("shots"))
    labels = labels_of([name for name, _ in shots], path)
    photos = PhotoSizes(images, path.parent)
    found = []
    for label, (name, shot) in zip(labels, shots, strict=True):
        key = shot.text("camera")
        if key not in cameras:
            raise shot.error(f"is {key[:60]!r}, which is not among the cameras", "camera")
        camera = cameras[key]
        width, height = _size(camera, name, photos)
        found.append(Camera(label, width, height, *_lens(camera, width, height), _pose(shot), name))
    points, colours, more = sparse_points(
        selected.table("points", "coordinates", 3), selected.table("points", "color", 3)
    )
    return reconstruction_of(
        found, path, points=points, colours=colours, georeference=_georeference(selected),
        notes=(*notes, *more),
    )  # fmt: skip


def _selected(parts: list[Record], chunk: str | None, path: Path) -> tuple[Record, list[str]]:
    if chunk is None:
        best = max(range(len(parts)), key=lambda i: len(parts[i].record("shots").values))
        if len(parts) == 1:
            return parts[best], []
        note = (
            f"The file holds {len(parts)} reconstructions. Number {best + 1}, which has the most "
            "photos, was read. [scan] chunk selects another."
        )
        return parts[best], [note]
    if chunk.isascii() and chunk.isdigit() and 1 <= int(chunk[:9]) <= len(parts):
        return parts[int(chunk) - 1], []
    raise InputError(
        f"found no reconstruction {chunk!r}; expected 1 to {len(parts)}",
        file=path,
        key="scan.chunk",
    )


def _size(camera: Record, name: str, photos: PhotoSizes) -> tuple[int, int]:
    width, height = camera.whole("width", 0), camera.whole("height", 0)
    if width and height:
        return width, height
    size = photos.size(name)
    if size is None:
        raise camera.error(
            f"is missing, and the photo {name[:60]!r} was not found; set [scan] images", "width"
        )
    return size


def _lens(camera: Record, width: int, height: int) -> Lens:
    kind = camera.text("projection_type", "perspective")
    if kind in PANORAMAS:
        if width != 2 * height:
            raise camera.error(
                "is a panorama that is not twice as wide as high, which is not supported", "width"
            )
        return panorama_lens(width, height)
    size = max(width, height)
    if kind == "dual":
        transition = camera.number("transition", 0.5)
        if transition not in (0.0, 1.0):
            raise camera.error(
                f"the lens 'dual' with transition {transition:g} is not supported: no lens "
                "model is "
                "exact; undistort the photos with OpenSfM",
                "projection_type",
            )
        kind = "perspective" if transition == 1.0 else "fisheye"
    if kind not in KINDS:
        raise camera.error(
            f"the lens {kind[:40]!r} is not supported; expected one of {', '.join(KINDS)}",
            "projection_type",
        )
    k = [camera.number(f"k{i}", 0.0) for i in range(1, 7)]
    p = camera.number("p1", 0.0), camera.number("p2", 0.0)
    if kind in ("perspective", "fisheye"):
        f = camera.number("focal") * size
        middle = width / 2, height / 2
        return (brown_lens if kind == "perspective" else fisheye_lens)(f, f, *middle, k[:2])
    fx, fy = camera.number("focal_x") * size, camera.number("focal_y") * size
    cx = camera.number("c_x", 0.0) * size + width / 2
    cy = camera.number("c_y", 0.0) * size + height / 2
    if kind == "brown":
        return brown_lens(fx, fy, cx, cy, k[:3], p)
    if kind in ("radial", "simple_radial"):
        return brown_lens(fx, fy, cx, cy, k[: 2 if kind == "radial" else 1])
    if kind == "fisheye_opencv":
        return fisheye_lens(fx, fy, cx, cy, k[:4])
    return _fisheye62(camera, (fx, fy, cx, cy), k, p)


def _fisheye62(
    camera: Record, frame: tuple[float, ...], k: list[float], p: tuple[float, float]
) -> Lens:
    """OpenSfM's model with six radial terms, and tangential terms of the undistorted point. COLMAP
    has a model for six radial terms, and one for four with tangential terms."""
    if not any(p):
        return "RAD_TAN_THIN_PRISM_FISHEYE", (*frame, *k, *(0.0,) * 6)
    if not (k[4] or k[5]):
        return "THIN_PRISM_FISHEYE", (*frame, k[0], k[1], *p, k[2], k[3], 0.0, 0.0)
    raise camera.error(
        "the lens 'fisheye62' with k5 or k6 together with p1 or p2 is not supported: no lens "
        "model is exact; undistort the photos with OpenSfM",
        "projection_type",
    )


def _pose(shot: Record) -> Pose:
    """World → camera, by Rodrigues's formula."""
    vector = shot.numbers("rotation", 3)
    angle = float(np.linalg.norm(vector))
    if not angle < 1e6:
        raise shot.error(f"is an angle of {angle:g} radians; expected at most π", "rotation")
    x, y, z = vector / angle if angle > 0 else vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return Pose(rotation, shot.numbers("translation", 3, default=np.zeros(3)))


def _georeference(part: Record) -> Georeference | None:
    if "reference_lla" not in part:
        return None
    place = part.record("reference_lla")
    latitude, longitude = place.number("latitude"), place.number("longitude")
    if not (-90 <= latitude <= 90 and -360 <= longitude <= 360):
        raise place.error(f"{latitude:g}, {longitude:g} is not a location on Earth", "latitude")
    return Georeference(latitude, longitude, place.number("altitude", 0.0), *np.eye(3))
