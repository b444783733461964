"""Reader for RealityScan's (RealityCapture's) camera files: the .csv "Internal/External camera
parameters", and .xmp files in the folder of the photos (realityscan_xmp.py).

Angles of the .csv: camera → world is Rz(−heading) · Rx(pitch) · Ry(roll), for a camera that looks
along −z with y up. Derived from a camera that was exported both ways (forums.unrealengine.com,
topic 710449, "Different rotation of cameras in XMP and CSV"): it reproduces the rotation of that
.xmp to 1e-6. Focal length and principal point: "RealityCapture XMP Camera Math" (Epic's knowledge
base).
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import regular_size
from ..camera import Camera, Pose
from ..parsing.json_record import as_number
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..reconstruction import Reconstruction, reconstruction_of
from .realityscan_lens import normalised_lens
from .realityscan_xmp import read_xmp_folder

Array = NDArray[np.float64]

MAX_FILE_BYTES = 1 << 26  # bytes; a hundred thousand cameras are 25 MB
AXES_FLIP = np.diag([1.0, -1.0, -1.0])  # x right, y up, z back → x right, y down, z forward
NEW_COLUMN_NAMES = {"yaw": "heading", "f_35mm": "f", "px_norm": "px", "py_norm": "py"}
REQUIRED_COLUMNS = ("name", "x", "y", "alt", "heading", "pitch", "roll", "f")
LENS_COLUMNS = ("px", "py", "k1", "k2", "k3", "k4", "t1", "t2")  # 0 where the column is missing


def read_realityscan(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras of a .csv, of one .xmp, or of a folder of these. Raises InputError."""
    if chunk is not None:
        raise InputError("RealityScan's files have no chunks", file=path, key="scan.chunk")
    if path.is_dir() or path.suffix.lower() == ".xmp":
        return read_xmp_folder(path, images)
    rows = _rows(path)
    labels = labels_of([name for name, _, _ in rows], path)
    photos = PhotoSizes(images, path.parent)
    cameras = []
    division = False
    for label, (name, values, line) in zip(labels, rows, strict=True):
        size = photos.size(name)
        if size is None:
            raise InputError(
                f"does not hold the size of the photo {name!r}, and the photo was not found; set "
                "[scan] images to the folder of the photos",
                file=path,
                line=line,
            )
        lens = normalised_lens(values, size)
        cameras.append(Camera(label, *size, *lens, _pose(values), name))
        distortion = [values[key] for key in LENS_COLUMNS[2:]]
        division |= bool(distortion[0]) and not any(distortion[1:])
    notes = ["Heading, pitch and roll are read as Rz(−heading) · Rx(pitch) · Ry(roll)."]
    if division:
        notes.append(
            "The file does not name its distortion model; k1 is read as Brown's. If the model was "
            "'division', export again with a Brown model."
        )
    return reconstruction_of(cameras, path, notes=tuple(notes))


def _rows(path: Path) -> list[tuple[str, dict[str, float], int]]:
    """(name of the photo, values by column, line) of each camera."""
    try:
        if regular_size(path) > MAX_FILE_BYTES:
            raise InputError("is too large for a list of cameras", file=path)
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    if b"\0" in data:
        raise InputError("is not a text file (in UTF-8)", file=path)
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        lines = data.decode("cp1252", "replace").splitlines()
    header: dict[str, int] | None = None
    rows: list[tuple[str, dict[str, float], int]] = []
    declared = None
    for number, text in enumerate(lines, 1):
        if text.startswith("#cameras"):
            declared = text.removeprefix("#cameras").strip(" ,\t")
        if not text.strip() or text.startswith("#cameras"):
            continue
        words = next(csv.reader([text]), [])
        if header is None:
            header = _header(words, path, number)
            continue
        rows.append(_row(words, header, path, number))
    if header is None:
        raise InputError("is empty", file=path)
    if declared is not None and declared != str(len(rows)):
        raise InputError(
            f"declares {declared[:20]!r} cameras and holds {len(rows)}; export it again", file=path
        )
    return rows


def _header(words: list[str], path: Path, line: int) -> dict[str, int]:
    """Index of each column by its name. Users can change the template of this export."""
    names = [word.strip().lstrip("#").lower() for word in words]
    header = {NEW_COLUMN_NAMES.get(name, name): i for i, name in enumerate(names)}
    missing = [name for name in REQUIRED_COLUMNS if name not in header]
    if missing:
        raise InputError(
            f"lacks the columns {', '.join(missing)}; expected RealityScan's "
            "'Internal/External camera "
            "parameters' with #name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2",
            file=path,
            line=line,
        )
    return header


def _row(
    words: list[str], header: dict[str, int], path: Path, line: int
) -> tuple[str, dict[str, float], int]:
    values = dict.fromkeys(LENS_COLUMNS, 0.0)
    for name in (*REQUIRED_COLUMNS[1:], *LENS_COLUMNS):
        if name not in header:
            continue
        word = words[header[name]] if header[name] < len(words) else ""
        number = as_number(word)
        if number is None:
            raise InputError(
                f"{word[:40]!r} is not a finite number", file=path, key=name, line=line
            )
        values[name] = number
    name = words[header["name"]] if header["name"] < len(words) else ""
    return name.strip(), values, line


def _pose(values: dict[str, float]) -> Pose:
    heading, pitch, roll = (np.radians(values[key]) for key in ("heading", "pitch", "roll"))
    to_world = _about(2, -heading) @ _about(0, pitch) @ _about(1, roll)
    rotation = AXES_FLIP @ to_world.T
    return Pose(rotation, -rotation @ np.array([values[key] for key in ("x", "y", "alt")]))


def _about(axis: int, angle: float) -> Array:
    """Rotation matrix about the axis x, y or z, right-handed."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix
