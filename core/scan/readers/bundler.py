"""Bundler's bundle.out, and list.txt with the photos' names.

N. Snavely, "Bundler User's Manual", section "Output format": x_cam = R X + t, looking along −z with
y up; p = −(x, y)/z; pixel = f (1 + k1 |p|² + k2 |p|⁴) p from the photo's centre, y up.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..lenses.brown import brown_lens
from ..parsing.json_record import BEYOND
from ..parsing.number_stream import NumberStream
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..parsing.sparse import sparse_points
from ..parsing.tracks import Tracks
from ..reconstruction import Reconstruction, reconstruction_of

Array = NDArray[np.float64]

EACH = 15  # numbers of a camera: f, k1, k2, R, t
TURN = np.diag([1.0, -1.0, -1.0])  # x right, y up, z back → x right, y down, z forward
LIST_LARGEST = 1 << 24  # bytes


def read_bundler(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras and points of a bundle.out. Raises InputError."""
    if chunk is not None:
        raise InputError("Bundler's files have no chunks", file=path, key="scan.chunk")
    with NumberStream(path) as stream:
        header = stream.text_line()
        if header is None or not re.fullmatch(r"#\s*Bundle file v0\.3", header):
            raise stream.error("does not begin with '# Bundle file v0.3': no file of Bundler's")
        sizes = stream.take(2)
        count = stream.bounded(sizes[0], "cameras", 2 * EACH)
        points = stream.bounded(sizes[1], "points", 2 * 7)
        values = stream.take(count * EACH).reshape(count, EACH)
        if not (np.abs(values) < BEYOND).all():
            raise stream.error("has a camera that is not made of finite numbers, in or above")
        tracks = _tracks(stream, count, points)
    names, notes = _names(path, count)
    labels = labels_of(names, path)
    photos = PhotoSizes(images, path.parent)
    cameras = []
    unaligned = estimated = 0
    for i, numbers in enumerate(values):
        if not numbers[3:12].any() and numbers[0] == 0:  # so says Bundler
            unaligned += 1
            continue
        size = photos.size(names[i])
        if size is None:
            estimated += 1
            size = _estimated(tracks, i, path, labels[i])
        cameras.append(_camera(labels[i], names[i], size, numbers))
    if unaligned:
        notes.append(f"{unaligned} photos without a pose were left out")
    if estimated:
        notes.append(
            f"photo sizes estimated from the features of {estimated} photos, because the photos "
            "were not found: give [scan] images"
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
            raise stream.error(f"ends early: it says {points:,} points and holds {found:,}")
    return tracks


def _camera(label: str, photo: str, size: tuple[int, int], numbers: Array) -> Camera:
    f, k1, k2 = (float(v) for v in numbers[:3])
    pose = Pose(TURN @ numbers[3:12].reshape(3, 3), TURN @ numbers[12:15])
    width, height = size
    centre = width / 2, height / 2
    return Camera(label, width, height, *brown_lens(f, f, *centre, (k1, k2)), pose, photo)


def _estimated(tracks: Tracks, camera: int, path: Path, label: str) -> tuple[int, int]:
    """A photo as large as its features need: they are counted from its centre."""
    reach = np.maximum(np.abs(tracks.least[camera]), np.abs(tracks.most[camera]))
    if not (np.isfinite(reach).all() and (reach > 0).all() and (reach < 1e9).all()):
        raise InputError(
            f"says neither how large the photo {label!r} is nor where a feature lies in it; "
            "give [scan] images",
            file=path,
        )
    width, height = np.ceil(2 * reach).astype(int)
    return int(width), int(height)


def _names(path: Path, count: int) -> tuple[list[str], list[str]]:
    """(the photos' names, notes). Bundler writes them to list.txt; COLMAP beside the file."""
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
    note = "there is no list.txt beside the file: its cameras are named by their number, 00000000 …"
    return [f"{i:08d}" for i in range(count)], [note]


def _listed(path: Path) -> list[str]:
    """A line a photo: its name, and where the focal length was known " 0 FOCAL"."""
    if path.stat().st_size > LIST_LARGEST:
        raise InputError("is too large for a list of photos", file=path)
    text = path.read_bytes().decode("utf-8-sig", "replace")
    lines = [line.strip() for line in text.splitlines()]
    return [re.sub(r"\s+0\s+[0-9.eE+-]+$", "", line) for line in lines if line]
