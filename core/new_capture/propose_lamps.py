"""Propose the lamps of a draft: which photo belongs to which, and of what kind they are."""

from __future__ import annotations

from collections.abc import Collection, Generator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..concurrency.steps import drained, scaled
from ..counted import counted
from ..errors import PatinaError
from ..light import DistantLight, MountedLight
from ..light_search import FoundLamp, LampPhoto, UnknownLamp, draw_lamp_pixels, find_lamps
from ..light_search.search import AMBIGUOUS_RATIO
from ..light_search.search import MIN_PIXELS as MIN_LIT_PIXELS
from ..photo import Transfer, read_exif, read_photo
from ..scan import Camera, Mesh
from ..scan.scan import find_camera
from . import group_lamps
from .draft import NEAR_KINDS, Draft, DraftLamp, DraftPhoto, LampKind
from .match_photos import time_of
from .near_lamps import NearLamps, direction_of, near_lamps
from .opened_scan import OpenedScan
from .photo_content import PIXELS as COARSE_PIXELS
from .photo_content import best_direction, fits_size

Array = NDArray[np.float64]

MAX_COMPARED_PHOTOS = 60  # whose light is searched for, each alone
MAX_SEARCHED_PHOTOS = 24  # the same, all together: about a second each
PIXELS = 3000  # of a photo
FLASH_COSINE = np.cos(np.radians(25.0))  # between light and view, of a flash on the camera
MIN_FLASH_SHARE = 0.8  # of the photos
FIRED_COSINE, MIN_FIRED_SHARE = np.cos(np.radians(45.0)), 0.5  # where EXIF says that it fired
MIN_FLASH_PHOTOS = 3
MIN_NEAR_PHOTOS = 3  # to tell near lamps from distant ones
HIDDEN_COSINE = np.cos(np.radians(5.0))  # between a lamp and a camera that would hide it
MAX_FLASH_OFFSET = 0.25  # of a flash from its lens, in distances of the object
BY_SHADING = "by shading"
COMPARE_SHARE, DISTANT_SHARE = 0.2, 0.5  # of the time, at the ends of these parts


def with_lamps(
    draft: Draft, opened: OpenedScan, grouped: Collection[Path] = ()
) -> Generator[float, None, Draft]:
    """The draft with a lamp for each photo; yields the fraction done.

    grouped: photos that keep their lamps, which the user may have edited; the lamps of the others
    are added.
    """
    used = [
        i
        for i, photo in enumerate(draft.photos)
        if photo.used and photo.camera is not None and photo.file not in grouped
    ]
    if not used:
        return draft
    parts: list[LampPhoto | None] = []
    directions: list[Array | None] = []
    for done, i in enumerate(used[:MAX_COMPARED_PHOTOS]):
        yield COMPARE_SHARE * done / len(used)
        part = _pixels(draft.photos[i], opened)
        parts.append(part)
        directions.append(None)
        if part is not None:
            few = part.first(COARSE_PIXELS)
            directions[-1], _ = best_direction(few, opened.rays, opened.dictionary)
    directions += [None] * (len(used) - len(directions))
    cosines = [
        -1.0 if part is None or one is None else _cosine_to_camera(one, part.camera, opened)
        for part, one in zip(parts, directions, strict=False)
    ]
    fired = all(_flash_fired(draft.photos[i].file) for i in used)
    if len(used) >= MIN_FLASH_PHOTOS and is_flash(cosines, len(used), fired):
        lamps, how = [0] * len(used), "the light comes from the camera"
        made = [_flash()]
    else:
        distant: list[FoundLamp | None] = []
        if len(used) <= MAX_SEARCHED_PHOTOS:
            distant = yield from scaled(_searched(parts, opened), COMPARE_SHARE, DISTANT_SHARE)
            directions = [None if one is None else direction_of(one) for one in distant]
        lamps, how = _groups(draft, used, directions)
        if how == BY_SHADING and max(lamps) == 0 and _behind_camera(parts, directions, opened):
            how = "a lamp there would stand behind the camera, so the light comes from the camera"
            return _with_made(draft, used, lamps, [_flash()], how)
        if len(distant) >= MIN_NEAR_PHOTOS and None not in distant and may_be_near(draft.lamps):
            known = lamps if how != BY_SHADING else None
            steps = _near(parts, distant, known, opened)
            near = yield from scaled(steps, DISTANT_SHARE, 1.0)
            if near is not None:
                how += "; the light comes from near the object"
                return _with_made(draft, used, near.groups, _near_made(draft, near), how)
        made = [
            DraftLamp(
                f"lamp {len(draft.lamps) + k + 1}",
                values=_mean([
                    one
                    for one, own in zip(directions, lamps, strict=True)
                    if own == k and one is not None
                ]),
            )
            for k in range(max(lamps) + 1)
        ]  # fmt: skip
    return _with_made(draft, used, lamps, made, how)


def may_be_near(lamps: Sequence[DraftLamp]) -> bool:
    """Whether new lamps may be near ones: near and distant lamps have no common scale."""
    return all(lamp.kind in NEAR_KINDS for lamp in lamps)


def _near(
    parts: Sequence[LampPhoto | None],
    distant: Sequence[FoundLamp | None],
    groups: list[int] | None,
    opened: OpenedScan,
) -> Generator[float, None, NearLamps | None]:
    """near_lamps of photos that all show enough."""
    shown = [part for part in parts if part is not None]
    found = [one for one in distant if one is not None]
    return (yield from near_lamps(shown, found, groups, _centre(opened.scan.mesh), opened))


def _near_made(draft: Draft, near: NearLamps) -> list[DraftLamp]:
    return [
        DraftLamp(f"lamp {len(draft.lamps) + k + 1}", LampKind.NEAR, _three(position))
        for k, position in enumerate(near.positions)
    ]


def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)


def _flash() -> DraftLamp:
    return DraftLamp("flash", LampKind.FLASH, (0.0, 0.0, 0.0))


def _with_made(
    draft: Draft, used: list[int], lamps: list[int], made: list[DraftLamp], how: str
) -> Draft:
    """The draft with new lamps. lamps: that of each used photo; how: it was found."""
    photos = list(draft.photos)
    for i, lamp in zip(used, lamps, strict=True):
        photos[i] = replace(photos[i], lamp=len(draft.lamps) + lamp)
    note = f"{counted(len(made), 'lamp')} for {counted(len(used), 'photo')}: {how}"
    return replace(
        draft, photos=tuple(photos), lamps=(*draft.lamps, *made), found=(*draft.found, note)
    )


def is_flash(cosines: Sequence[float], photos: int, fired: bool) -> bool:
    """Whether the light of the photos comes from a flash on the camera.

    cosines: between light and view, of the photos that were compared. fired: whether a flash fired
    in every photo by its EXIF, which may stand away from the camera; less agreement is then enough.
    """
    limit, share = (FIRED_COSINE, MIN_FIRED_SHARE) if fired else (FLASH_COSINE, MIN_FLASH_SHARE)
    return sum(cosine > limit for cosine in cosines) >= share * photos


def _flash_fired(file: Path) -> bool:
    try:
        return bool(read_exif(file).flash_fired)
    except PatinaError:
        return False


def _groups(draft: Draft, used: list[int], directions: list[Array | None]) -> tuple[list[int], str]:
    """(lamp of each used photo, why)."""
    files = [draft.photos[i].file for i in used]
    found = group_lamps.by_folder_or_name(files)
    if found is not None:
        return found, "by folder or name"
    found = group_lamps.by_time(files, {file: time_of(file) for file in files})
    if found is not None:
        return found, "by pauses between the photos"
    known = [one for one in directions if one is not None]
    if len(used) > MAX_COMPARED_PHOTOS or not known:
        why = "too many to compare" if known else "too dark to compare"
        return [0] * len(files), f"one for all, because the photos are {why}"
    shared = iter(group_lamps.by_direction(known))
    lamps = [None if one is None else next(shared) for one in directions]
    extra = max(k for k in lamps if k is not None)
    for place, lamp in enumerate(lamps):  # a photo that shows too little gets a lamp of its own
        if lamp is None:
            extra += 1
            lamps[place] = extra
    return [k for k in lamps if k is not None], BY_SHADING


def _behind_camera(
    parts: Sequence[LampPhoto | None], directions: Sequence[Array | None], opened: OpenedScan
) -> bool:
    """Whether one distant lamp for all photos would be hidden by a camera, and a flash explains the
    photos about as well. Photos of a flat object, all from the front, do not tell the two apart."""
    known = [one for one in directions if one is not None]
    shown = [part for part in parts if part is not None]
    if len(shown) < MIN_FLASH_PHOTOS or not known:
        return False
    shared = np.array(_mean(known))
    if max(_cosine_to_camera(shared, part.camera, opened) for part in shown) < HIDDEN_COSINE:
        return False
    found: list[FoundLamp] = []
    for light in (DistantLight("lamp", shared), MountedLight("flash", np.zeros(3))):
        steps = find_lamps(
            [UnknownLamp(light, tuple(shown))], 1, opened.rays, opened.dictionary, with_errors=False
        )
        found += [one for one in drained(steps).lamps if one is not None]
    lamp, flash = found
    assert isinstance(flash.light, MountedLight)
    away = min(
        float(np.linalg.norm(part.camera.pose.centre - _centre(opened.scan.mesh))) for part in shown
    )
    on_camera = np.linalg.norm(flash.light.offset) < MAX_FLASH_OFFSET * away
    return bool(on_camera and flash.cost <= AMBIGUOUS_RATIO * lamp.cost)


def _mean(directions: list[Array]) -> tuple[float, float, float]:
    """The mean direction, (0, 0, 1) of none."""
    total = np.sum(directions, axis=0) if directions else np.array([0.0, 0.0, 1.0])
    return _three(total / max(float(np.linalg.norm(total)), 1e-9))


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


def _searched(
    parts: list[LampPhoto | None], opened: OpenedScan
) -> Generator[float, None, list[FoundLamp | None]]:
    """The distant lamp of each photo, all photos together; None without pixels."""
    lamps = [
        UnknownLamp(DistantLight(f"{k}", np.array([0.0, 0.0, 1.0])), (part,))
        for k, part in enumerate(parts)
        if part is not None
    ]
    if not lamps:
        return [None] * len(parts)
    result = yield from find_lamps(lamps, 1, opened.rays, opened.dictionary, with_errors=False)
    found = iter(result.lamps)
    return [None if part is None else next(found) for part in parts]


def _cosine_to_camera(direction: Array, camera: Camera, opened: OpenedScan) -> float:
    """Cosine between the directions to the light and to the camera."""
    towards = camera.pose.centre - _centre(opened.scan.mesh)
    if camera.orthographic:
        towards = -camera.pose.rotation[2]
    return float(direction @ towards / max(float(np.linalg.norm(towards)), 1e-30))


def _centre(mesh: Mesh) -> Array:
    used = mesh.vertices[np.unique(mesh.faces)]
    return np.asarray(0.5 * (used.min(axis=0) + used.max(axis=0)))
