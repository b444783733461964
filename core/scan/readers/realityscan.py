"""RealityScan's (RealityCapture's) camera files: the .csv "Internal/External camera parameters" and
.xmp files beside the photos (realityscan_xmp.py).

Angles of the .csv: camera → world is Rz(−heading) · Rx(pitch) · Ry(roll), of a camera that looks
along −z with y up. Found in a camera that was exported both ways (forums.unrealengine.com, topic
710449, "Different rotation of cameras in XMP and CSV"): it gives the rotation of that .xmp to
1e-6. Focal length and principal point: "RealityCapture XMP Camera Math" (Epic's knowledge base).
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..parsing.json_record import as_number
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..reconstruction import Reconstruction, reconstruction_of
from .realityscan_lens import normalised_lens
from .realityscan_xmp import read_xmp_folder

Array = NDArray[np.float64]

LARGEST = 1 << 26  # bytes; a hundred thousand cameras are 25 MB
TURN = np.diag([1.0, -1.0, -1.0])  # x right, y up, z back → x right, y down, z forward
NEWER = {"yaw": "heading", "f_35mm": "f", "px_norm": "px", "py_norm": "py"}
NEEDED = ("name", "x", "y", "alt", "heading", "pitch", "roll", "f")
LENS = ("px", "py", "k1", "k2", "k3", "k4", "t1", "t2")  # 0 where there is no such column


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
                f"does not say how large the photo {name!r} is, and the photo is not found: give "
                "[scan] images",
                file=path,
                line=line,
            )
        lens = normalised_lens(values, size)
        cameras.append(Camera(label, *size, *lens, _pose(values), name))
        distortion = [values[key] for key in LENS[2:]]
        division |= bool(distortion[0]) and not any(distortion[1:])
    notes = ["heading, pitch and roll are read as Rz(−heading) · Rx(pitch) · Ry(roll)"]
    if division:
        notes.append(
            "k1 alone is read as Brown's: the file does not name its distortion model; if that was "
            "'division', export with a Brown model"
        )
    return reconstruction_of(cameras, path, notes=tuple(notes))


def _rows(path: Path) -> list[tuple[str, dict[str, float], int]]:
    """(the photo's name, numbers by column, line) of each camera."""
    try:
        if path.stat().st_size > LARGEST:
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
    announced = None
    for number, text in enumerate(lines, 1):
        if text.startswith("#cameras"):
            announced = text.removeprefix("#cameras").strip(" ,\t")
        if not text.strip() or text.startswith("#cameras"):
            continue
        words = next(csv.reader([text]), [])
        if header is None:
            header = _header(words, path, number)
            continue
        rows.append(_row(words, header, path, number))
    if header is None:
        raise InputError("is empty", file=path)
    if announced is not None and announced != str(len(rows)):
        raise InputError(
            f"says {announced[:20]!r} cameras and holds {len(rows)}: was it cut off?", file=path
        )
    return rows


def _header(words: list[str], path: Path, line: int) -> dict[str, int]:
    """Column by name; the template of this export can be changed by its user."""
    names = [word.strip().lstrip("#").lower() for word in words]
    header = {NEWER.get(name, name): i for i, name in enumerate(names)}
    missing = [name for name in NEEDED if name not in header]
    if missing:
        raise InputError(
            f"has no column {', '.join(missing)}; expected RealityScan's 'Internal/External camera "
            "parameters' with #name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2",
            file=path,
            line=line,
        )
    return header


def _row(
    words: list[str], header: dict[str, int], path: Path, line: int
) -> tuple[str, dict[str, float], int]:
    values = dict.fromkeys(LENS, 0.0)
    for name in (*NEEDED[1:], *LENS):
        if name not in header:
            continue
        word = words[header[name]] if header[name] < len(words) else ""
        number = as_number(word)
        if number is None:
            raise InputError(f"{word[:40]!r} is no finite number", file=path, key=name, line=line)
        values[name] = number
    name = words[header["name"]] if header["name"] < len(words) else ""
    return name.strip(), values, line


def _pose(values: dict[str, float]) -> Pose:
    heading, pitch, roll = (np.radians(values[key]) for key in ("heading", "pitch", "roll"))
    to_world = _about(2, -heading) @ _about(0, pitch) @ _about(1, roll)
    rotation = TURN @ to_world.T
    return Pose(rotation, -rotation @ np.array([values[key] for key in ("x", "y", "alt")]))


def _about(axis: int, angle: float) -> Array:
    """Rotation about x, y or z, right-handed."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix
