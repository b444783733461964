"""Reader for Bundler's bundle.out, and list.txt with the names of the photos.

N. Snavely, "Bundler User's Manual", section "Output format": x_cam = R X + t, looking along −z with
y up; p = −(x, y)/z; pixel = f (1 + k1 |p|² + k2 |p|⁴) p from the photo's centre, y up.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...counted import counted
from ...errors import InputError
from ...files import regular_size
from ..camera import Camera, Pose
from ..lenses.brown import brown_lens
from ..parsing.json_record import MAX_MAGNITUDE
from ..parsing.number_stream import NumberStream
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..parsing.sparse import sparse_points
from ..parsing.tracks import Tracks
from ..reconstruction import Reconstruction, reconstruction_of

Array = NDArray[np.float64]

VALUES_PER_CAMERA = 15  # f, k1, k2, R (9 values), t (3 values)
AXES_FLIP = np.diag([1.0, -1.0, -1.0])  # x right, y up, z back → x right, y down, z forward
MAX_LIST_BYTES = 1 << 24  # bytes


def read_bundler(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras and points of a bundle.out. Raises InputError."""
    if chunk is not None:
        raise InputError("Bundler's files have no chunks", file=path, key="scan.chunk")
    with NumberStream(path) as stream:
        header = stream.text_line()
        if header is None or not re.fullmatch(r"#\s*Bundle file v0\.3", header):
            raise stream.error("does not begin with '# Bundle file v0.3'; expected a Bundler file")
        sizes = stream.take(2)
        count = stream.bounded(sizes[0], "cameras", 2 * VALUES_PER_CAMERA)
        points = stream.bounded(sizes[1], "points", 2 * 7)
        values = stream.take(count * VALUES_PER_CAMERA).reshape(count, VALUES_PER_CAMERA)
        if not (np.abs(values) < MAX_MAGNITUDE).all():
            raise stream.error(
                "has a camera whose values are not all finite, on this line or above"
            )
        tracks = _tracks(stream, count, points)
    names, notes = _names(path, count)
    labels = labels_of(names, path)
    photos = PhotoSizes(images, path.parent)
    cameras = []
    unaligned = estimated = 0
    for i, row in enumerate(values):
        if not row[3:12].any() and row[0] == 0:  # Bundler's mark of an unaligned photo
            unaligned += 1
            continue
        size = photos.size(names[i])
        if size is None:
            estimated += 1
            size = _estimated(tracks, i, path, labels[i])
        cameras.append(_camera(labels[i], names[i], size, row))
    if unaligned:
        notes.append(f"Photos without a pose that were left out: {unaligned}.")
    if estimated:
        notes.append(
            f"The sizes of {counted(estimated, 'photo')} were estimated from their features, "
            "because the photos were not found. Set [scan] images to the folder of the photos."
        )
    places, colours, more = sparse_points(*tracks.all_points())
    return reconstruction_of(cameras, path, points=places, colours=colours, notes=(*notes, *more))


def _tracks(stream: NumberStream, cameras: int, points: int) -> Tracks:
    tracks = Tracks(cameras)
    found = 0
    while found < points:
        values = stream.available()
        used, here = tracks.add(values, points - found, stream)
        stream.take(used)
        found += here
        if not here and not stream.more():
            raise stream.error(f"ends early: it declares {points:,} points and holds {found:,}")
    return tracks


def _camera(label: str, photo: str, size: tuple[int, int], values: Array) -> Camera:
    f, k1, k2 = (float(v) for v in values[:3])
    pose = Pose(AXES_FLIP @ values[3:12].reshape(3, 3), AXES_FLIP @ values[12:15])
    width, height = size
    centre = width / 2, height / 2
    return Camera(label, width, height, *brown_lens(f, f, *centre, (k1, k2)), pose, photo)


def _estimated(tracks: Tracks, camera: int, path: Path, label: str) -> tuple[int, int]:
    """(width, height) of the smallest photo that holds all its features; they are counted from its
    centre."""
    reach = np.maximum(np.abs(tracks.least[camera]), np.abs(tracks.most[camera]))
    if not (np.isfinite(reach).all() and (reach > 0).all() and (reach < 1e9).all()):
        raise InputError(
            f"holds neither the size of the photo {label!r} nor a feature in it; "
            "set [scan] images to the folder of the photos",
            file=path,
        )
    width, height = np.ceil(2 * reach).astype(int)
    return int(width), int(height)


def _names(path: Path, count: int) -> tuple[list[str], list[str]]:
    """(names of the photos, notes). Bundler writes the names to list.txt; COLMAP writes them to a
    file next to bundle.out."""
    folder = path.parent
    candidates = [
        path.with_name(path.name + ".list.txt"),
        path.with_name(path.stem + ".list.txt"),
        folder / "list.txt",
    ]
    if folder.name == "bundle":  # Bundler's own layout
        candidates.append(folder.parent / "list.txt")
    for candidate in candidates:
        if candidate.is_file():
            names = _listed(candidate)
            if len(names) != count:
                raise InputError(
                    f"lists {len(names)} photos; {path.name} has {count} cameras", file=candidate
                )
            return names, []
    note = "There is no list.txt in the file's folder. Cameras are named by number: 00000000 …"
    return [f"{i:08d}" for i in range(count)], [note]


def _listed(path: Path) -> list[str]:
    """Names from a list with one photo per line: the name, then " 0 FOCAL" where the focal length
    was known."""
    if regular_size(path) > MAX_LIST_BYTES:
        raise InputError("is too large for a list of photos", file=path)
    text = path.read_bytes().decode("utf-8-sig", "replace")
    lines = [line.strip() for line in text.splitlines()]
    return [re.sub(r"\s+0\s+[0-9.eE+-]+$", "", line) for line in lines if line]
