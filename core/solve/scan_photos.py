"""The scan's own photos: find their files, and choose those to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from ..errors import PatinaError
from ..photo import image_size
from ..scan import Camera
from .photo_set import PICTURES

SUFFIXES = ("", *sorted(PICTURES), *sorted(s.upper() for s in PICTURES))


@dataclass(frozen=True)
class ScanPhoto:
    """A photo of the scan with its camera, of the photo's size."""

    camera: Camera
    path: Path


def scan_photos(cameras: Sequence[Camera], images: Path) -> tuple[list[ScanPhoto], list[str]]:
    """(photos that were found, in the order of the cameras; notes about those that were not
    used)."""
    found: list[ScanPhoto] = []
    notes: list[str] = []
    missing = 0
    for camera in cameras:
        path = _photo_of(camera, images)
        if path is None:
            missing += 1
            continue
        try:
            found.append(ScanPhoto(camera.resized(*image_size(path)), path))
        except PatinaError as error:
            notes.append(f"{path.name}: {error}")
    if missing:
        notes.append(f"Cameras without a photo: {missing} (in the folder {images.name}).")
    return found, notes


def _photo_of(camera: Camera, images: Path) -> Path | None:
    """The file in the folder with the camera's label, or with the name of the camera's photo."""
    names = [camera.label]
    if camera.photo:
        inside = PurePosixPath(camera.photo.replace("\\", "/"))
        names += [str(inside), inside.name] if not inside.is_absolute() else [inside.name]
    for name in names:
        if ".." in PurePosixPath(name).parts or PurePosixPath(name).is_absolute():
            continue
        for suffix in SUFFIXES:
            path = images / f"{name}{suffix}"
            if path.is_file():
                return path
    return None


def spread(photos: Sequence[ScanPhoto], count: int) -> list[int]:
    """Indices of ``count`` photos with views as different as possible: farthest-point sampling of
    their positions and directions."""
    centres = np.array([photo.camera.pose.centre for photo in photos])
    forward = np.array([photo.camera.pose.rotation[2] for photo in photos])
    size = max(float(np.median(np.linalg.norm(centres - centres.mean(axis=0), axis=1))), 1e-12)
    place = np.concatenate([(centres - centres.mean(axis=0)) / size, forward], axis=1)
    selected = [0]
    distance = np.linalg.norm(place - place[0], axis=1)
    while len(selected) < min(count, len(photos)):
        selected.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(place - place[selected[-1]], axis=1))
    return sorted(selected)


def nearest(
    photos: Sequence[ScanPhoto],
    centre: NDArray[np.float64],
    target: NDArray[np.float64],
    count: int,
) -> list[int]:
    """Indices of the photos that see ``target`` (3,) most like a camera at ``centre``, by the angle
    between them and the ratio of their distances."""
    away = np.array([photo.camera.pose.centre for photo in photos]) - target
    own = centre - target
    length, reach = np.linalg.norm(away, axis=1), max(float(np.linalg.norm(own)), 1e-300)
    cosine = (away @ own) / np.maximum(length * reach, 1e-300)
    off = np.arccos(np.clip(cosine, -1.0, 1.0)) + 0.5 * np.abs(np.log(length / reach + 1e-300))
    return [int(i) for i in np.argsort(off, kind="stable")[:count]]
