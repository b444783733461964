"""Restrict a capture to some of its photos, so that the others can be held out of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..capture import Capture
from ..errors import InputError
from ..inputs.photos import LitPhotos


def photo_indices(capture: Capture, photos: Sequence[str | int]) -> list[int]:
    """Indices (from 0) of photos that are given by index or by file name.

    A name is the path as in the capture file, or its last part where that is unique. Raises
    InputError.
    """
    names = [capture.photo_name(place) for place in range(len(capture.photos))]
    found = []
    for photo in photos:
        if isinstance(photo, int):
            fits = [photo] if 0 <= photo < len(names) else []
        else:
            fits = [i for i, name in enumerate(names) if name == photo]
            fits = fits or [i for i, name in enumerate(names) if name.split("/")[-1] == photo]
        if len(fits) != 1:
            what = "no photo is named" if not fits else f"{len(fits)} photos are named"
            raise InputError(
                f"{what} {photo!r}; expected an index from 0 to {len(names) - 1}, or a file such "
                f"as {', '.join(names[:3])} …",
                file=capture.file,
                key="photo",
            )
        found.append(fits[0])
    return found


def select_photos(capture: Capture, photos: Sequence[str | int]) -> Capture:
    """The capture with only these photos, in its own order, and only their lights.

    Raises InputError for a photo that does not exist, for an empty selection, and where leaving
    out the first photo would change the unit of radiance of the given light strengths.
    """
    keep = sorted(set(photo_indices(capture, photos)))
    if not keep:
        raise InputError(
            "no photo is selected; expected at least one", file=capture.file, key="photo"
        )
    if keep[0] != 0 and any(light.strength is not None for light in capture.lights):
        lit = LitPhotos.open(capture)
        if lit.first is not None and lit.exposures[keep[0]][0] != 1.0:
            raise capture.error(
                "exposures come from EXIF, relative to this photo, and so does the unit of the "
                "lights' strength; keep this photo, or give exposure for all photos",
                "photo", 0, "exposure",
            )  # fmt: skip
    used = {capture.photos[place].light for place in keep}
    lamps = [place for place, light in enumerate(capture.lights) if light.name in used]
    moved = {
        **{("photo", old): ("photo", new) for new, old in enumerate(keep)},
        **{("light", old): ("light", new) for new, old in enumerate(lamps)},
    }
    lines = {}
    for path, line in capture.lines.items():
        head = path[:2]
        if len(path) > 1 and path[0] in ("photo", "light"):
            if head not in moved:
                continue
            path = (*moved[head], *path[2:])  # type: ignore[index]
        lines[path] = line
    return replace(
        capture,
        photos=tuple(capture.photos[place] for place in keep),
        lights=tuple(capture.lights[place] for place in lamps),
        lines=lines,
    )
