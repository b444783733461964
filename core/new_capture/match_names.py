"""Match photos to the scan's cameras by file name, number or time."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path, PurePosixPath

from ..scan import Camera
from ..scan.scan import find_camera

NUMBER = re.compile(r"\d+")


def by_name(photos: Sequence[Path], cameras: Sequence[Camera]) -> dict[Path, str]:
    """Photo → label of the camera of the same name, apart from folder and extension."""
    found = {photo: find_camera(cameras, photo.name) for photo in photos}
    return {photo: camera.label for photo, camera in found.items() if camera is not None}


def by_number(photos: Sequence[Path], cameras: Sequence[Camera]) -> dict[Path, str]:
    """Photo → label of the camera with the same number in its name, if that holds for ALL photos.

    The number is the last one of a name (lit_007 ↔ IMG_0007). Numbers that occur twice match
    nothing.
    """
    of_camera = _numbers([camera.label for camera in cameras])
    of_photo = _numbers([photo.name for photo in photos])
    if len(of_photo) < len(photos) or not set(of_photo) <= set(of_camera):
        return {}
    names = {photo.name: photo for photo in photos}
    return {names[name]: of_camera[number] for number, name in of_photo.items()}


def by_time(
    photos: Mapping[Path, datetime | None], scan_photos: Mapping[str, datetime | None]
) -> dict[Path, str]:
    """Photo → label of the camera whose photo has the same place in the order of time, if there are
    as many photos as cameras and all times are known.

    photos: times of the lit photos; scan_photos: label → time of the scan's own photo.
    """
    lit = {photo: time for photo, time in photos.items() if time is not None}
    scan = {label: time for label, time in scan_photos.items() if time is not None}
    if not lit or len(lit) != len(photos) or len(scan) != len(scan_photos) or len(lit) != len(scan):
        return {}
    order = sorted(lit, key=lambda photo: (lit[photo], photo.name))
    return dict(zip(order, sorted(scan, key=lambda label: (scan[label], label)), strict=True))


def _numbers(names: Sequence[str]) -> dict[int, str]:
    """Last number → name, of the names in which it is unique."""
    found: dict[int, list[str]] = {}
    for name in names:
        stem = PurePosixPath(name.replace("\\", "/")).stem
        numbers = NUMBER.findall(stem)
        if numbers:
            found.setdefault(int(numbers[-1]), []).append(name)
    return {number: same[0] for number, same in found.items() if len(same) == 1}
