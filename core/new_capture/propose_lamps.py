"""Propose the lamps of a draft: which photo belongs to which, and of what kind they are."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..counted import counted
from ..light import DistantLight
from ..light_search import LampPhoto, UnknownLamp, draw_lamp_pixels, find_lamps
from ..light_search.search import MIN_PIXELS as MIN_LIT_PIXELS
from ..photo import Transfer, read_photo
from ..scan import Camera, Mesh
from ..scan.scan import find_camera
from . import group_lamps
from .draft import Draft, DraftLamp, DraftPhoto, LampKind
from .match_photos import time_of
from .opened_scan import OpenedScan
from .photo_content import PIXELS as COARSE_PIXELS
from .photo_content import best_direction, fits_size

Array = NDArray[np.float64]

MAX_COMPARED_PHOTOS = 60  # whose light is searched for, each alone
MAX_SEARCHED_PHOTOS = 24  # the same, all together: about a second each
PIXELS = 3000  # of a photo
FLASH_COSINE = np.cos(np.radians(25.0))  # between light and view, of a flash on the camera
MIN_FLASH_SHARE = 0.8  # of the photos
MIN_FLASH_PHOTOS = 3


def with_lamps(draft: Draft, opened: OpenedScan) -> Generator[float, None, Draft]:
    """The draft with a lamp for each photo; yields the fraction done."""
    used = [i for i, photo in enumerate(draft.photos) if photo.used and photo.camera is not None]
    if not used:
        return draft
    directions: list[Array] = []
    from_camera: list[bool] = []
    parts: list[LampPhoto] = []
    for done, i in enumerate(used[:MAX_COMPARED_PHOTOS]):
        yield 0.4 * done / len(used)
        part = _pixels(draft.photos[i], opened)
        if part is None:
            parts.clear()
            break
        parts.append(part)
        direction, _ = best_direction(part.first(COARSE_PIXELS), opened.rays, opened.dictionary)
        directions.append(direction)
        from_camera.append(_from_camera(direction, part.camera, opened))
    if len(used) >= MIN_FLASH_PHOTOS and sum(from_camera) >= MIN_FLASH_SHARE * len(used):
        lamps, how = [0] * len(used), "the light comes from the camera"
        made = [DraftLamp("flash", LampKind.FLASH, (0.0, 0.0, 0.0))]
    else:
        if len(used) == len(parts) <= MAX_SEARCHED_PHOTOS:
            directions = yield from _searched(parts, opened)
        lamps, how = _groups(draft, used, directions)
        made = [
            DraftLamp(
                f"lamp {k + 1}",
                values=_mean([d for d, own in zip(directions, lamps, strict=False) if own == k]),
            )
            for k in range(max(lamps) + 1)
        ]
    photos = list(draft.photos)
    for i, lamp in zip(used, lamps, strict=True):
        photos[i] = replace(photos[i], lamp=lamp)
    note = f"{counted(len(made), 'lamp')} for {counted(len(used), 'photo')}: {how}"
    return replace(draft, photos=tuple(photos), lamps=tuple(made), found=(*draft.found, note))


def _groups(draft: Draft, used: list[int], directions: list[Array]) -> tuple[list[int], str]:
    """(lamp of each used photo, why)."""
    files = [draft.photos[i].file for i in used]
    found = group_lamps.by_folder_or_name(files)
    if found is not None:
        return found, "by folder or name"
    found = group_lamps.by_time(files, {file: time_of(file) for file in files})
    if found is not None:
        return found, "by pauses between the photos"
    if directions:
        return group_lamps.by_direction(directions), "by shading"
    return [0] * len(files), "one for all, because there are too many photos to compare"


def _mean(directions: list[Array]) -> tuple[float, float, float]:
    """The mean direction, (0, 0, 1) of none."""
    total = np.sum(directions, axis=0) if directions else np.array([0.0, 0.0, 1.0])
    x, y, z = total / max(float(np.linalg.norm(total)), 1e-9)
    return float(x), float(y), float(z)


def _pixels(photo: DraftPhoto, opened: OpenedScan) -> LampPhoto | None:
    """Random pixels of a photo; None where it does not show the mesh, which is reported when the
    capture is imported."""
    camera = find_camera(opened.scan.cameras, photo.camera or "")
    assert camera is not None  # a matched photo has a camera of the scan
    lit = read_photo(photo.file, Transfer.named("auto"))
    height, width = lit.radiance.shape[:2]
    if not fits_size(camera, width, height):
        return None
    usable = np.where(lit.clipped, -1, 0).astype(np.int16)
    rng = np.random.default_rng(0)
    part = draw_lamp_pixels(
        opened.rays, camera.resized(width, height), lit.radiance, usable, PIXELS, rng
    )
    return part if (part.radiance > 0).sum() >= MIN_LIT_PIXELS else None


def _searched(parts: list[LampPhoto], opened: OpenedScan) -> Generator[float, None, list[Array]]:
    """Direction of the light of each photo, all photos together."""
    lamps = [
        UnknownLamp(DistantLight(f"{k}", np.array([0.0, 0.0, 1.0])), (part,))
        for k, part in enumerate(parts)
    ]
    steps = find_lamps(lamps, 1, opened.rays, opened.dictionary, with_errors=False)
    while True:
        try:
            done = next(steps)
        except StopIteration as stop:
            found = stop.value.lamps
            break
        yield 0.4 + 0.6 * done
    return [one.light.direction for one in found if one is not None]


def _from_camera(direction: Array, camera: Camera, opened: OpenedScan) -> bool:
    """Whether the light comes from the direction of the camera."""
    towards = camera.pose.centre - _centre(opened.scan.mesh)
    if camera.orthographic:
        towards = -camera.pose.rotation[2]
    cosine = float(direction @ towards / max(float(np.linalg.norm(towards)), 1e-30))
    return cosine > FLASH_COSINE


def _centre(mesh: Mesh) -> Array:
    used = mesh.vertices[np.unique(mesh.faces)]
    return np.asarray(0.5 * (used.min(axis=0) + used.max(axis=0)))
