"""Reader for VisualSFM's .nvm (NVM_V3), and the same format as COLMAP writes it.

http://ccwu.me/vsfm/doc.html#nvm, and LoadNVM in PBA's util.h: a camera is a name, focal length,
quaternion w x y z (world → camera, x right, y down, z forward), centre, radial distortion r, 0.
nvm_flavour.py finds out which tool wrote the file, and so the meaning of r.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...counted import counted
from ...errors import InputError
from ..camera import Camera, Pose
from ..parsing.json_record import as_number
from ..parsing.number_stream import NumberStream
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..parsing.sparse import sparse_points
from ..parsing.tracks import Tracks
from ..reconstruction import Reconstruction, reconstruction_of
from .nvm_flavour import NvmFlavour, NvmModel

Array = NDArray[np.float64]


def read_nvm(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras and points of an .nvm. chunk: number of the model ("1", "2" …); without it the model
    with the most cameras. Raises InputError."""
    with NumberStream(path) as stream:
        fixed = _header(stream)
        models: list[NvmModel] = []
        while (model := _model(stream)) is not None:
            models.append(model)
    if not models:
        raise InputError("holds no model; expected matched photos", file=path)
    notes: list[str] = []
    if chunk is None:
        selected = max(range(len(models)), key=lambda i: len(models[i].names))
        if len(models) > 1:
            notes.append(
                f"The file holds {len(models)} models. Model {selected + 1}, which has the most "
                "cameras, was read. [scan] chunk selects another."
            )
    elif chunk.isascii() and chunk.isdigit() and 1 <= int(chunk[:9]) <= len(models):
        selected = int(chunk) - 1
    else:
        known = f"1 to {len(models)}"
        raise InputError(f"found no model {chunk!r}; expected {known}", file=path, key="scan.chunk")
    return _reconstruction(models[selected], fixed, PhotoSizes(images, path.parent), path, notes)


def _header(stream: NumberStream) -> list[float] | None:
    """fx, cx, fy, cy (, r) of "NVM_V3 FixedK …"; None without FixedK."""
    words = (stream.text_line() or "").split()
    if not words or words[0] != "NVM_V3":
        raise stream.error("does not begin with NVM_V3; expected a VisualSFM file of that version")
    if len(words) == 1:
        return None
    if words[1] == "FixedK" and len(words) in (6, 7):
        found = [as_number(word) for word in words[2:]]
        calibration = [number for number in found if number is not None]
        if len(calibration) == len(found) and min(calibration[0], calibration[2]) > 0:
            return calibration
    raise stream.error("has an invalid first line; expected NVM_V3 [FixedK fx cx fy cy [r]]")


def _model(stream: NumberStream) -> NvmModel | None:
    """The next model; None after the last one: "0", a comment, or the end of the file."""
    text = stream.text_line()
    if text is None or text == "0" or text.startswith("#"):
        return None
    if not text.isascii() or not text.isdigit() or len(text) > 18:
        raise stream.error(f"{text[:40]!r} is not a number of cameras")
    count = stream.bounded(int(text), "cameras", 2 * 11)
    names: list[str] = []
    values: list[list[float]] = []
    for _ in range(count):
        line = stream.text_line()
        if line is None:
            raise stream.error(
                f"ends early: it declares {count:,} cameras and holds {len(names):,}"
            )
        words = line.rsplit(maxsplit=10)
        found = [as_number(word) for word in words[1:]]
        camera_values = [value for value in found if value is not None]
        if len(camera_values) != 10:
            raise stream.error("is not a valid camera; expected a name and 10 finite numbers")
        names.append(words[0].replace('"', " "))  # VisualSFM writes a blank as "
        values.append(camera_values)
    points = stream.count("points", 2 * 7)
    tracks = Tracks(count)
    found_points = 0
    while found_points < points:
        piece, lines = stream.lines_of_numbers(points - found_points)
        if not lines:
            raise stream.error(
                f"ends early: it declares {points:,} points and holds {found_points:,}"
            )
        used, here = tracks.add(piece, lines, stream)
        if used != len(piece) or here != lines:
            raise stream.error("has an incomplete point, on this line or above")
        found_points += here
    return NvmModel(names, np.array(values).reshape(-1, 10), tracks)


def _reconstruction(
    model: NvmModel, fixed: list[float] | None, photos: PhotoSizes, path: Path, notes: list[str]
) -> Reconstruction:
    labels = labels_of(model.names, path)
    sizes = [photos.size(name) for name in model.names]
    poses = [_pose(camera_values) for camera_values in model.values]
    flavour = NvmFlavour.of(model, poses, sizes, fixed)
    missing = sum(size is None for size in sizes)
    found = flavour.estimated_sizes(path) if missing else []
    cameras = []
    for i, (label, name, size) in enumerate(zip(labels, model.names, sizes, strict=True)):
        width, height = size if size is not None else found[i]
        lens = flavour.lens(i, (width, height))
        cameras.append(Camera(label, width, height, *lens, poses[i], name))
    if missing:
        notes.append(
            f"The sizes of {counted(missing, 'photo')} were estimated from their features, "
            "because the photos were not found. Set [scan] images to the folder of the photos."
        )
    if not flavour.measured and model.values[:, 8].any():
        notes.append(
            "The distortion is read as COLMAP writes it, because that fits the file's observations."
        )
    places, colours, more = sparse_points(*model.tracks.all_points())
    return reconstruction_of(cameras, path, points=places, colours=colours, notes=(*notes, *more))


def _pose(camera_values: Array) -> Pose:
    """Pose from quaternion w x y z and centre. A quaternion of length 0 gives an invalid rotation,
    which is rejected later with the camera's name."""
    q = camera_values[1:5]
    with np.errstate(all="ignore"):
        w, x, y, z = q / np.linalg.norm(q)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return Pose(rotation, -rotation @ camera_values[5:8])
