"""Find the scan camera of each lit photo."""

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..concurrency.steps import scaled
from ..counted import counted
from ..errors import PatinaError
from ..photo import Photo, Transfer, read_exif, read_photo
from ..scan import Camera
from ..scan.scan import find_camera
from . import match_names
from .draft import Draft
from .opened_scan import OpenedScan
from .photo_content import (
    Picture,
    best_match,
    content_costs,
    fits_size,
    outline,
    outside_share,
    refutes,
)

COMPARED = 3  # photos matched by number or time whose shading is compared
REFUTE_SHARE = 0.2  # of the time
MAX_WRONG_OUTSIDE = 0.05  # of a photo's lit pixels outside the mesh, for a camera by number or time


class _Outlines:
    """Outlines of the mesh from every camera, computed once per size of picture."""

    def __init__(self, opened: OpenedScan) -> None:
        self.opened = opened
        self.cache: dict[tuple[int, int], list[NDArray]] = {}

    def __call__(self, shape: tuple[int, int]) -> list[NDArray]:
        """(h, w) bool for each camera."""
        if shape not in self.cache:
            self.cache[shape] = [
                outline(camera, shape, self.opened.rays) for camera in self.opened.scan.cameras
            ]
        return self.cache[shape]


def matched(
    draft: Draft, opened: OpenedScan, chosen: Collection[Path] = ()
) -> Generator[float, None, Draft]:
    """The draft with a camera for each photo that has none: by name, else by number or time if the
    photo's content agrees, else by its content. Yields the fraction done.

    chosen: photos that the user chose one by one or has seen already. Others that match no camera
    are switched off where some match by name: a folder may also hold masks and textures.
    """
    cameras = opened.scan.cameras
    files = [photo.file for photo in draft.photos if photo.camera is None]
    named = match_names.by_name(files, cameras)
    rest = [file for file in files if file not in named]
    stated, how = match_names.by_number(rest, cameras), "by number"
    if not stated:
        stated, how = _timed(rest, draft.images, cameras), "by time"
    found = {file: (label, "by name") for file, label in named.items()}
    outlines = _Outlines(opened)
    refuted = yield from scaled(_refuted(stated, opened, outlines), 0.0, REFUTE_SHARE)
    if refuted:
        stated = {}
    found |= {file: (label, how) for file, label in stated.items()}
    rest = [file for file in rest if file not in stated]
    share = (1 - REFUTE_SHARE) / max(len(rest), 1)
    for place, file in enumerate(rest):
        yield REFUTE_SHARE + share * place
        photo = _read(file)
        if photo is None:
            continue
        costs = yield from scaled(
            _costs(photo, opened, outlines),
            REFUTE_SHARE + share * place,
            REFUTE_SHARE + share * (place + 1),
        )
        label = best_match(costs)
        if label is not None:
            found[file] = label, "by content"
    photos = [
        replace(photo, camera=found[photo.file][0], how=found[photo.file][1])
        if photo.file in found
        else photo
        for photo in draft.photos
    ]
    off = {p.file for p in photos if p.camera is None and named and p.file not in chosen}
    sentences = list(draft.found)
    if off:
        left = counted(len(off), "other picture")
        sentences.append(f"Switched off: {left} without a camera of the same name")
    photos = [replace(p, used=p.used and p.file not in off) for p in photos]
    return replace(draft, photos=tuple(photos), found=tuple(sentences))


def _refuted(
    stated: Mapping[Path, str], opened: OpenedScan, outlines: _Outlines
) -> Generator[float, None, bool]:
    """Whether one photo disagrees with its camera by number or time, which refutes the order of
    all. All are compared with the outline of the mesh, a few also with the shading seen from other
    cameras. Yields the fraction done."""
    files = list(stated)
    compared = {files[int(i)] for i in np.linspace(0, len(files) - 1, min(len(files), COMPARED))}
    for place, file in enumerate(files):
        yield place / len(files)
        photo = _read(file)
        if photo is None:
            continue
        if not _agrees(photo, stated[file], opened.scan.cameras, outlines):
            return True
        if file in compared:
            costs = yield from scaled(
                _costs(photo, opened, outlines), place / len(files), (place + 1) / len(files)
            )
            if refutes(costs, stated[file]):
                return True
    return False


def _costs(
    photo: Photo, opened: OpenedScan, outlines: _Outlines
) -> Generator[float, None, dict[str, float]]:
    return content_costs(
        photo.radiance, ~photo.clipped, opened.scan.cameras, outlines, opened.rays,
        opened.dictionary,
    )  # fmt: skip


def _read(file: Path) -> Photo | None:
    """The photo; None where it cannot be read, which was reported when the files were sorted."""
    try:
        return read_photo(file, Transfer.named("auto"))
    except PatinaError:
        return None


def _agrees(photo: Photo, label: str, cameras: Sequence[Camera], outlines: _Outlines) -> bool:
    """Whether the photo may be from this camera. A photo without a dark background may."""
    picture = Picture.of(photo.radiance)
    index = next(i for i, camera in enumerate(cameras) if camera.label == label)
    height, width = photo.radiance.shape[:2]
    if not fits_size(cameras[index], width, height):
        return False
    if not picture.dark_background:
        return True
    return outside_share(picture, outlines(picture.shape)[index]) < MAX_WRONG_OUTSIDE


def _timed(
    files: Sequence[Path], images: Path | None, cameras: Sequence[Camera]
) -> dict[Path, str]:
    """Photos by the order of time, where the scan's own photos are there."""
    if images is None:
        return {}
    own: dict[str, datetime | None] = {}
    for path in sorted(images.iterdir()):
        camera = find_camera(cameras, path.name)
        if camera is not None:
            own[camera.label] = time_of(path)
    return match_names.by_time({file: time_of(file) for file in files}, own)


def time_of(file: Path) -> datetime | None:
    """Time of a photo by its EXIF, None without one."""
    try:
        return read_exif(file).datetime_original
    except PatinaError:
        return None
